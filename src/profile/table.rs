//! Formats a profile as text tables for the terminal.

use std::fmt::Write;

use super::rows::{DrawRow, Profile};

/// Largest number of draws that are printed, the most expensive first. `draws.csv` has all of them.
const SHOWN: usize = 20;

/// Returns all tables.
pub fn text(profile: &Profile) -> String {
    let mut text = steps(profile);
    for part in [passes(profile), draws(profile), modes(profile)] {
        text.push('\n');
        text.push_str(&part);
    }
    let _ = writeln!(text, "\nmedians of {} frames, 95 % intervals; clock {}", profile.frames, profile.clock);
    text
}

fn steps(profile: &Profile) -> String {
    let row =
        |step: &super::StepRow| vec![step.step.clone(), time(step.cpu_us), interval(step.cpu_us_low, step.cpu_us_high)];
    table(&["host step", "µs", "interval"], profile.steps.iter().map(row))
}

fn passes(profile: &Profile) -> String {
    let heads = ["pass", "GPU µs", "interval", "draws", "vertices run", "clipping in", "clipping out", "fragments run"];
    let rows = profile.passes.iter().map(|pass| {
        let mut cells = vec![pass.pass.clone(), time(pass.gpu_us), interval(pass.gpu_us_low, pass.gpu_us_high)];
        cells.push(pass.draws.to_string());
        let counts = [pass.vertices_run, pass.clipping_invocations, pass.clipping_primitives, pass.fragments_run];
        cells.extend(counts.map(count));
        cells
    });
    table(&heads, rows)
}

fn draws(profile: &Profile) -> String {
    let mut slowest: Vec<&DrawRow> = profile.draws.iter().collect();
    slowest.sort_by(|a, b| b.gpu_us.total_cmp(&a.gpu_us));
    let heads = [
        "draw",
        "GPU µs",
        "interval",
        "instances",
        "vertices",
        "vertices run",
        "clipping in",
        "clipping out",
        "fragments run",
    ];
    let rows = slowest.iter().take(SHOWN).map(|draw| {
        let mut cells = vec![draw.label.clone(), time(draw.gpu_us), interval(draw.gpu_us_low, draw.gpu_us_high)];
        cells.extend([draw.instances, draw.vertices].map(|n| n.to_string()));
        let counts = [draw.vertices_run, draw.clipping_invocations, draw.clipping_primitives, draw.fragments_run];
        cells.extend(counts.map(count));
        cells
    });
    let mut text = table(&heads, rows);
    if slowest.len() > SHOWN {
        let _ = writeln!(text, "and {} faster draws, see draws.csv", slowest.len() - SHOWN);
    }
    text
}

fn modes(profile: &Profile) -> String {
    let heads = [
        "mode",
        "commands",
        "draws",
        "triangles",
        "record µs",
        "interval",
        "per draw",
        "ratio",
        "GPU µs",
        "interval",
        "per draw",
        "ratio",
    ];
    let rows = profile.modes.iter().map(|mode| {
        vec![
            format!("{} {}", mode.form, mode.submission),
            mode.commands.to_string(),
            mode.draws.to_string(),
            mode.triangles.to_string(),
            time(mode.record_us),
            interval(mode.record_us_low, mode.record_us_high),
            format!("{:.3}", mode.record_us_per_draw),
            format!("{:.2}", mode.record_ratio),
            time(mode.gpu_us),
            interval(mode.gpu_us_low, mode.gpu_us_high),
            time(mode.gpu_us_per_draw),
            format!("{:.2}", mode.gpu_ratio),
        ]
    });
    table(&heads, rows)
}

fn time(us: f64) -> String {
    format!("{us:.1}")
}

fn interval(low: f64, high: f64) -> String {
    format!("{low:.1}–{high:.1}")
}

fn count(count: Option<u64>) -> String {
    count.map_or("–".to_string(), |n| n.to_string())
}

/// Formats a table. The first column is aligned to the left, the others to the right.
fn table(heads: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut lines = vec![heads.iter().map(|head| head.to_string()).collect::<Vec<_>>()];
    lines.extend(rows);
    let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<_> = (0..heads.len()).map(width).collect();
    let cell = |(column, text): (usize, &String)| match column {
        0 => format!("{text:<0$}", widths[0]),
        _ => format!("  {text:>0$}", widths[column]),
    };
    lines.iter().map(|line| line.iter().enumerate().map(cell).collect::<String>() + "\n").collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_stand_under_each_other() {
        let rows = [["a", "1"], ["longer", "100"]].map(|row| row.map(str::to_string).to_vec());
        assert_eq!(table(&["draw", "µs"], rows.into_iter()), "draw     µs\na         1\nlonger  100\n");
    }

    #[test]
    fn a_short_table_mentions_no_further_draws() {
        let text = text(&Profile { frames: 7, clock: "calibrated".to_string(), ..Profile::default() });
        assert!(text.ends_with("medians of 7 frames, 95 % intervals; clock calibrated\n"), "{text}");
        assert!(!text.contains("faster draws"), "{text}");
    }
}
