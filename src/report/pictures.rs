//! Embeds picture files in a page.

use std::path::{Component, Path};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::FilterType;

/// Largest width of an embedded picture, pixels.
const WIDTH: u32 = 960;
/// JPEG quality of embedded pictures, 1 to 100.
const QUALITY: u8 = 85;

/// Returns a picture file as a data URI of a JPEG; `None` if it is missing, not a picture, or outside the folder.
pub fn data_uri(folder: &Path, file: &str) -> Option<String> {
    let inside = Path::new(file).components().all(|part| matches!(part, Component::Normal(_)));
    let picture = image::open(inside.then(|| folder.join(file))?).ok()?.into_rgb8();
    let width = picture.width().min(WIDTH);
    let height = (u64::from(picture.height()) * u64::from(width)).div_ceil(u64::from(picture.width())) as u32;
    let small = image::imageops::resize(&picture, width, height.max(1), FilterType::Triangle);
    let mut bytes = Vec::new();
    small.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, QUALITY)).ok()?;
    Some(format!("data:image/jpeg;base64,{}", STANDARD.encode(bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_pictures_inside_the_directory_are_embedded() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("run");
        std::fs::create_dir(&inner).unwrap();
        image::RgbImage::from_pixel(1200, 100, image::Rgb([200, 30, 30])).save(inner.join("a.png")).unwrap();
        std::fs::copy(inner.join("a.png"), folder.path().join("b.png")).unwrap();
        std::fs::write(inner.join("c.png"), "no picture").unwrap();
        let uri = data_uri(&inner, "a.png").unwrap();
        let bytes = STANDARD.decode(uri.strip_prefix("data:image/jpeg;base64,").unwrap()).unwrap();
        let picture = image::load_from_memory(&bytes).unwrap().into_rgb8();
        assert_eq!((picture.width(), picture.height()), (960, 80));
        assert!(picture.get_pixel(480, 40).0[0].abs_diff(200) < 8);
        for file in ["../b.png", "c.png", "d.png"] {
            assert_eq!(data_uri(&inner, file), None, "{file}");
        }
    }
}
