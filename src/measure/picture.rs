//! Finds pixels of a picture where the sky shows through terrain.

/// Returns the smallest distance from the terrain's outline in the reference picture at which a missing pixel is a
/// hole, pixels. Closer to it, the tolerance may have moved the outline, and rasterisation by one more pixel.
pub fn outline_radius(tolerance_px: f64) -> usize {
    tolerance_px.ceil() as usize + 1
}

/// Dilates a mask: selects all pixels within `radius` of a selected one, in x and in y.
///
/// # Panics
/// If the mask does not consist of whole rows.
pub fn dilated(mask: &[bool], width: usize, radius: usize) -> Vec<bool> {
    let open: Vec<bool> = mask.iter().map(|m| !m).collect();
    inside(&open, width, radius).into_iter().map(|m| !m).collect()
}

/// Returns the pixels, numbered row by row, that `covered` does not contain although `truth` contains all pixels within
/// `radius` of them, in x and in y.
///
/// # Panics
/// If the masks differ in size or do not consist of whole rows.
pub fn hole_pixels(covered: &[bool], truth: &[bool], width: usize, radius: usize) -> Vec<usize> {
    assert_eq!(covered.len(), truth.len(), "two pictures of one size");
    assert!(width > 0 && covered.len().is_multiple_of(width), "whole rows");
    let inner = inside(truth, width, radius);
    (0..covered.len()).filter(|&k| inner[k] && !covered[k]).collect()
}

/// Erodes a mask by a square: keeps the pixels all of whose neighbours within `radius` are set. Works along x, then
/// along y.
fn inside(mask: &[bool], width: usize, radius: usize) -> Vec<bool> {
    let height = mask.len() / width;
    let mut rows = vec![false; mask.len()];
    let mut both = vec![false; mask.len()];
    for y in 0..height {
        erode((0..width).map(|x| y * width + x), mask, &mut rows, radius);
    }
    for x in 0..width {
        erode((0..height).map(|y| y * width + x), &rows, &mut both, radius);
    }
    both
}

/// Erodes one line of pixels: keeps those without an unset pixel within `radius`.
fn erode(line: impl ExactSizeIterator<Item = usize> + Clone, from: &[bool], to: &mut [bool], radius: usize) {
    let mut ahead = line.clone().enumerate().filter(|&(_, k)| !from[k]).map(|(n, _)| n).peekable();
    let mut behind = None;
    for (n, k) in line.enumerate() {
        while let Some(open) = ahead.next_if(|&open| open <= n) {
            behind = Some(open);
        }
        let near_behind = behind.is_some_and(|open| n - open <= radius);
        let near_ahead = ahead.peek().is_some_and(|&open| open - n <= radius);
        to[k] = !near_behind && !near_ahead;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(rows: &[&str]) -> (Vec<bool>, usize) {
        (rows.iter().flat_map(|row| row.chars().map(|c| c == '#')).collect(), rows[0].len())
    }

    #[test]
    fn only_open_pixels_well_inside_the_terrain_are_holes() {
        let (truth, width) = picture(&[".......", "#######", "#######", "#######", "#######"]);
        let (covered, _) = picture(&[".......", "..#####", "#######", "####.##", ".######"]);
        assert_eq!(hole_pixels(&covered, &truth, width, 0), [7, 8, 25, 28]);
        assert_eq!(hole_pixels(&covered, &truth, width, 1), [25, 28]);
        assert_eq!(hole_pixels(&covered, &truth, width, 3), [28]);
        assert!(hole_pixels(&covered, &truth, width, 4).is_empty());
        assert!(hole_pixels(&truth, &truth, width, 0).is_empty());
    }

    #[test]
    fn erosion_is_a_window_at_every_pixel() {
        let (width, height) = (23, 17);
        let mut seed = 5u32;
        let mut random = || {
            seed = seed.wrapping_mul(1664525).wrapping_add(1013904223);
            seed >> 24
        };
        for radius in 0..5 {
            let mask: Vec<bool> = (0..width * height).map(|_| random() > 6).collect();
            let near = |a: usize, b: usize| {
                (a % width).abs_diff(b % width) <= radius && (a / width).abs_diff(b / width) <= radius
            };
            let expected: Vec<bool> =
                (0..mask.len()).map(|k| (0..mask.len()).all(|o| mask[o] || !near(k, o))).collect();
            assert_eq!(inside(&mask, width, radius), expected);
        }
    }

    #[test]
    fn radius_follows_the_tolerance() {
        assert_eq!([0.5, 1.0, 1.5, 8.0].map(outline_radius), [2, 2, 3, 9]);
    }
}
