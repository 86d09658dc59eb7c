//! Fields, and forms of techniques, on which the invariants are tested.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use cuesta::internal::height::{Field, Holes, Samples};
use cuesta::internal::lod::{Entry, Setting, Settings, TECHNIQUES, Values};
use cuesta::internal::stress::views;

/// A choice of variant and settings.
pub struct Form {
    pub name: String,
    pub entry: &'static Entry,
    pub settings: Settings,
}

/// Returns forms in which every value of each setting meets every value of each other setting, and every variant.
pub fn forms(entry: &'static Entry) -> Vec<Form> {
    pairwise(combinations(entry)).iter().map(|choice| form(entry, choice)).collect()
}

/// A value for each setting, preceded by the variant under an empty key.
type Choice = Vec<(String, String)>;

fn combinations(entry: &Entry) -> Vec<Choice> {
    let variants = std::iter::once("").chain(entry.variants.iter().map(|variant| variant.name));
    let mut choices: Vec<_> = variants.map(|name| vec![(String::new(), name.to_string())]).collect();
    for setting in entry.settings {
        let with = |chosen: &Choice| {
            let chosen = chosen.clone();
            values(setting)
                .into_iter()
                .map(move |value| [chosen.clone(), vec![(setting.key.to_string(), value)]].concat())
        };
        choices = choices.iter().flat_map(with).collect();
    }
    choices
}

/// Returns a small subset of the choices that covers all pairs of values. Greedily adds the choice with most new pairs.
fn pairwise(mut choices: Vec<Choice>) -> Vec<Choice> {
    let pairs = |choice: &Choice| -> Vec<_> {
        let upto = |k: usize| choice[..=k].iter().map(move |earlier| (earlier.clone(), choice[k].clone()));
        (0..choice.len()).flat_map(upto).collect()
    };
    let (mut seen, mut few) = (HashSet::new(), Vec::new());
    loop {
        let news = |choice: &Choice| pairs(choice).iter().filter(|pair| !seen.contains(*pair)).count();
        let Some(best) = (0..choices.len()).rev().max_by_key(|&k| news(&choices[k])) else { return few };
        if !few.is_empty() && news(&choices[best]) == 0 {
            return few;
        }
        seen.extend(pairs(&choices[best]));
        few.push(choices.swap_remove(best));
    }
}

/// Returns the values at which a setting is tested: every word, or a number far below the default, because a length for
/// real terrain has no effect on these small fields.
fn values(setting: &Setting) -> Vec<String> {
    match setting.values {
        Values::Words(words) => words.iter().map(|word| word.to_string()).collect(),
        Values::Number(low, _) => {
            let default: f64 = setting.default.parse().expect("a number");
            vec![(default / 25.0).max(low).to_string()]
        }
    }
}

fn form(entry: &'static Entry, choice: &Choice) -> Form {
    let ((_, variant), choices) = choice.split_first().expect("a variant or none");
    let set: Vec<_> = choices.iter().map(|(key, value)| format!("{key}={value}")).collect();
    let variant = (!variant.is_empty()).then_some(variant.as_str());
    let name = format!("{}{} {}", entry.name, variant.map(|v| format!(":{v}")).unwrap_or_default(), set.join(" "));
    Form { name, entry, settings: Settings::new(entry, variant, choices).expect("the table's own values") }
}

/// Returns a deterministic number in 0..1 for a lattice position.
fn noise(i: u32, j: u32) -> f32 {
    let mut k = i.wrapping_mul(0x9e37_79b1) ^ j.wrapping_mul(0x85eb_ca77);
    k = (k ^ (k >> 15)).wrapping_mul(0x2c1b_3c6d);
    k = (k ^ (k >> 12)).wrapping_mul(0x297a_2d39);
    ((k ^ (k >> 15)) >> 8) as f32 / (1 << 24) as f32
}

/// Returns hills of several sizes, from 0 to about `height`.
fn hills(i: u32, j: u32, height: f32) -> f32 {
    let wave = |scale: f32, by: f32| ((i as f32 / scale + by).sin() + (j as f32 / scale - by).cos()) / 4.0 + 0.5;
    height * (0.6 * wave(17.0, 1.0) + 0.25 * wave(5.3, 2.0) + 0.1 * wave(2.1, 3.0) + 0.05 * noise(i, j))
}

fn field(size: [u32; 2], spacing: [f64; 2], height: impl Fn(u32, u32) -> f32) -> Field {
    holed(size, spacing, height, |_, _| false)
}

fn holed(
    [w, h]: [u32; 2],
    spacing: [f64; 2],
    height: impl Fn(u32, u32) -> f32,
    is_hole: impl Fn(u32, u32) -> bool,
) -> Field {
    let mut holes = Holes::none((w * h) as usize);
    (0..w * h).filter(|k| is_hole(k % w, k / w)).for_each(|k| holes.insert(k as usize));
    let heights = (0..w * h).map(|k| height(k % w, k / w)).collect();
    Field::new(Samples::F32(heights), [w, h], spacing, holes)
}

/// Returns the test fields with their names.
pub fn fields() -> Vec<(&'static str, Arc<Field>)> {
    let mut fields = vec![
        ("flat", field([65, 65], [10.0, 10.0], |_, _| 5.0)),
        ("ramp", field([81, 66], [2.0, 2.0], |i, j| 3.0 * i as f32 - 0.5 * j as f32)),
        ("a cliff on a plain", field([97, 97], [1.0, 1.0], |i, j| if i + j / 3 > 60 { 80.0 } else { 0.0 })),
        ("noise", field([67, 90], [5.0, 5.0], |i, j| 40.0 * noise(i, j))),
        ("2 × 2", field([2, 2], [1.0, 1.0], |i, j| (i * j) as f32)),
        ("2 × 77", field([2, 77], [1.0, 1.0], |i, j| 6.0 * noise(i, j))),
        ("131 × 67", field([131, 67], [30.0, 30.0], |i, j| hills(i, j, 900.0))),
        ("narrow and wide cells", field([70, 100], [0.25, 40.0], |i, j| hills(i, j, 60.0))),
        (
            "spikes of 1e5 m",
            field([66, 66], [1.0, 1.0], |i, j| if noise(i, j) > 0.995 { 1e5 } else { -1e5 * noise(j, i) }),
        ),
        ("tiled", field([41, 30], [8.0, 8.0], |i, j| hills(i, j, 100.0)).tiled([3, 4])),
        ("holes", holed([140, 90], [10.0, 10.0], |i, j| hills(i, j, 300.0), islands)),
        ("nothing but holes", holed([20, 20], [1.0, 1.0], |_, _| 1.0, |_, _| true)),
    ];
    fields[6].1.origin = [5.0e6, -3.0e6];
    fields.extend(stretched_r16());
    fields.extend(srtm_with_voids());
    fields.into_iter().map(|(name, field)| (name, Arc::new(field))).collect()
}

/// Returns true for a lake, for whole blocks at one side, and for scattered single samples.
fn islands(i: u32, j: u32) -> bool {
    let lake = (f64::from(i) - 40.0).hypot(f64::from(j) - 30.0) < 21.0;
    lake || i > 105 + j / 9 || noise(i, j) > 0.99
}

/// Real terrain, little-endian codes for 693 to 3416 m: Taiwan, Ministry of the Interior.
fn stretched_r16() -> Option<(&'static str, Field)> {
    let bytes = real("taiwan_xueshan_513x513_le_stretched.r16")?;
    let code = |i: u32, j: u32| {
        let k = 2 * ((j + 130) * 513 + i + 90) as usize;
        f32::from(u16::from_le_bytes([bytes[k], bytes[k + 1]]))
    };
    let height = |i, j| 693.0 + code(i, j) * ((3416.0 - 693.0) / 65535.0);
    Some(("real mountains", field([193, 161], [20.0, 20.0], height)))
}

/// Real terrain with voids: SRTM, Andorra.
fn srtm_with_voids() -> Option<(&'static str, Field)> {
    let bytes = real("N42E001.hgt")?;
    let metres = |k: usize| i16::from_be_bytes([bytes[2 * k], bytes[2 * k + 1]]);
    // The window begins a little before the first void.
    let void = (0..bytes.len() / 2).find(|&k| metres(k) == i16::MIN && k % 1201 > 40 && k % 1201 < 1100)?;
    let (x, z) = (void % 1201 - 30, (void / 1201).saturating_sub(20).min(1201 - 120));
    let at = |i: u32, j: u32| metres((z + j as usize) * 1201 + x + i as usize);
    Some(("real voids", holed([101, 120], [68.0, 92.0], |i, j| f32::from(at(i, j)), |i, j| at(i, j) == i16::MIN)))
}

fn real(file: &str) -> Option<Vec<u8>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(file);
    let bytes = std::fs::read(path).ok();
    if bytes.is_none() {
        println!("skipped: no real terrain, ../shared/data/{file} is absent");
    }
    bytes
}

#[test]
fn fields_have_whole_and_partial_views() {
    for (name, field) in fields() {
        let whole = views::views(&field).iter().filter(|(_, view)| views::sees_everything(&field, view)).count();
        assert!((1..8).contains(&whole), "{name}: wholly visible in {whole} views");
    }
}

#[test]
fn forms_cover_all_pairs_of_settings() {
    for entry in TECHNIQUES {
        let forms = forms(entry);
        let whole = combinations(entry).len();
        for (k, one) in entry.settings.iter().enumerate() {
            for other in &entry.settings[..k] {
                for (a, b) in
                    values(one).into_iter().flat_map(|a| values(other).into_iter().map(move |b| (a.clone(), b)))
                {
                    let pair = [format!("{}={a}", one.key), format!("{}={b}", other.key)];
                    let meet = |form: &Form| pair.iter().all(|part| form.name.split(' ').any(|word| word == part));
                    assert!(forms.iter().any(meet), "{}: {pair:?}", entry.name);
                }
            }
        }
        println!("{}: {} forms of {whole} combinations", entry.name, forms.len());
    }
}
