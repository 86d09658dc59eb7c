//! Fields, forms of techniques and views that the laws are tried on.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use cuesta::height::{Field, Holes, Samples};
use cuesta::lod::{Entry, Setting, Settings, Values, Variant};
use cuesta::view::{Containment, Lens, Metric, Tolerance, View};
use glam::DVec3;

/// One choice of variant and settings.
pub struct Form {
    pub name: String,
    pub entry: &'static Entry,
    pub settings: Settings,
}

/// Settings of an entry so that any two values of any two settings meet in one of them, and each variant with the
/// default ones and with each single one: a variant changes how a list is submitted.
pub fn forms(entry: &'static Entry) -> Vec<Form> {
    let whole = pairwise(entry.settings);
    let whole = whole.iter().map(|choice| form(entry, None, choice));
    let single = entry.settings.iter().flat_map(|setting| choices(setting).into_iter().map(|choice| vec![choice]));
    let single: Vec<_> = std::iter::once(Vec::new()).chain(single).collect();
    let of_variant = |variant: &'static Variant| single.iter().map(|choice| form(entry, Some(variant.name), choice));
    whole.chain(entry.variants.iter().flat_map(of_variant)).collect()
}

/// Few combinations of settings in which all pairs of their values occur: each next one is that of all with the most
/// pairs that were in none before.
fn pairwise(settings: &[Setting]) -> Vec<Vec<(String, String)>> {
    let mut all: Vec<Vec<(String, String)>> = vec![Vec::new()];
    for setting in settings {
        let with = |chosen: &Vec<_>| {
            let chosen = chosen.clone();
            choices(setting).into_iter().map(move |choice| [chosen.clone(), vec![choice]].concat())
        };
        all = all.iter().flat_map(with).collect();
    }
    let pairs = |row: &[(String, String)]| {
        let pair = |k: usize| (0..=k).map(move |l| (k, l));
        let all = (0..row.len()).flat_map(pair).map(|(k, l)| [row[k].clone(), row[l].clone()]);
        all.collect::<HashSet<_>>()
    };
    let (mut rows, mut met) = (Vec::new(), HashSet::new());
    while let Some(row) = all.iter().rev().max_by_key(|row| pairs(row).difference(&met).count()) {
        let found = pairs(row);
        if !rows.is_empty() && found.is_subset(&met) {
            break;
        }
        met.extend(found);
        rows.push(row.clone());
    }
    rows
}

/// A setting's key with each value that it is tried at.
fn choices(setting: &Setting) -> Vec<(String, String)> {
    values(setting).into_iter().map(|value| (setting.key.to_string(), value)).collect()
}

/// The values that a setting is tried at: every word, and for a number one far below its default, since a length
/// that suits real land shows nothing on these fields.
fn values(setting: &Setting) -> Vec<String> {
    match setting.values {
        Values::Words(words) => words.iter().map(|word| word.to_string()).collect(),
        Values::Number(low, _) => {
            let default: f64 = setting.default.parse().expect("a number");
            vec![(default / 25.0).max(low).to_string()]
        }
    }
}

fn form(entry: &'static Entry, variant: Option<&str>, choices: &[(String, String)]) -> Form {
    let set: Vec<_> = choices.iter().map(|(key, value)| format!("{key}={value}")).collect();
    let name = format!("{}{} {}", entry.name, variant.map(|v| format!(":{v}")).unwrap_or_default(), set.join(" "));
    Form { name, entry, settings: Settings::new(entry, variant, choices).expect("the table's own values") }
}

/// A deterministic number in 0..1 for a lattice position.
fn noise(i: u32, j: u32) -> f32 {
    let mut k = i.wrapping_mul(0x9e37_79b1) ^ j.wrapping_mul(0x85eb_ca77);
    k = (k ^ (k >> 15)).wrapping_mul(0x2c1b_3c6d);
    k = (k ^ (k >> 12)).wrapping_mul(0x297a_2d39);
    ((k ^ (k >> 15)) >> 8) as f32 / (1 << 24) as f32
}

/// Hills of a few sizes, 0 to about `height`.
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

/// The fields, by name.
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

/// A lake, whole blocks without data at one side, and scattered single samples.
fn islands(i: u32, j: u32) -> bool {
    let lake = (f64::from(i) - 40.0).hypot(f64::from(j) - 30.0) < 21.0;
    lake || i > 105 + j / 9 || noise(i, j) > 0.99
}

/// Real land, little-endian codes for 693 to 3416 m: Taiwan, Ministry of the Interior.
fn stretched_r16() -> Option<(&'static str, Field)> {
    let bytes = real("taiwan_xueshan_513x513_le_stretched.r16")?;
    let code = |i: u32, j: u32| {
        let k = 2 * ((j + 130) * 513 + i + 90) as usize;
        f32::from(u16::from_le_bytes([bytes[k], bytes[k + 1]]))
    };
    let height = |i, j| 693.0 + code(i, j) * ((3416.0 - 693.0) / 65535.0);
    Some(("real mountains", field([193, 161], [20.0, 20.0], height)))
}

/// Real land with voids: SRTM, Andorra.
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
        println!("skipped: no real land, ../shared/data/{file} is absent");
    }
    bytes
}

/// The view with another tolerance, certified.
pub fn with_tolerance(view: &View, px: f64) -> View {
    View { tolerance: Tolerance { px, metric: Metric::Certified }, ..*view }
}

/// Views of a field, near and far from it and far from each other: from one to the next is a teleport.
pub fn views(field: &Field) -> Vec<(&'static str, View)> {
    let [w, h] = field.size().map(f64::from);
    let (low, high) = (field.world_at(0.0, 0.0, 0.0), field.world_at(w - 1.0, h - 1.0, 0.0));
    let (size, range) = (high - low, field.statistics());
    let at = |u: f64, v: f64, above: f64| {
        let ground = field.height(((w - 1.0) * u.min(1.0)) as u32, ((h - 1.0) * v.min(1.0)) as u32);
        low + size * DVec3::new(u, 0.0, v) + DVec3::Y * (f64::from(ground) + above)
    };
    let (middle, extent) = (at(0.5, 0.5, 0.0), size.length());
    let pinhole = |eye, rotation, degrees: f64| perspective(eye, rotation, degrees, extent);
    let towards = |eye: DVec3| View::looking_along(middle - eye);
    let (corner, far) = (at(-0.1, 1.1, 0.0) + DVec3::Y * extent / 3.0, middle + DVec3::new(7.0, 4.0, -9.0) * extent);
    let above = middle + DVec3::Y * extent;
    let under = DVec3::new(middle.x, f64::from(range.min) - extent / 5.0, middle.z);
    let over = DVec3::new(middle.x, f64::from(range.max) + extent, middle.z);
    vec![
        ("inside", pinhole(at(0.45, 0.55, extent / 40.0), View::turned(30.0, -10.0, 0.0), 90.0)),
        ("on a vertex", pinhole(at(0.5, 0.5, 0.0), View::turned(200.0, 0.0, 0.0), 60.0)),
        ("from above a corner", pinhole(corner, towards(corner), 60.0)),
        ("far outside", pinhole(far, towards(far), 30.0)),
        ("straight down", pinhole(above, View::turned(90.0, -90.0, 0.0), 75.0)),
        ("from under the land", pinhole(under, View::turned(0.0, 60.0, 20.0), 100.0)),
        ("5°", pinhole(corner, towards(corner), 5.0)),
        ("120°, upside down", pinhole(at(0.2, 0.3, extent / 15.0), View::turned(45.0, -30.0, 180.0), 120.0)),
        ("orthographic", orthographic(corner, towards(corner), extent / 2.0)),
        ("orthographic, all", orthographic(over, View::turned(-90.0, -90.0, 0.0), 3.0 * extent)),
        ("away from it", pinhole(far, View::looking_along(far - middle), 60.0)),
    ]
}

fn perspective(eye: DVec3, world_from_eye: glam::DMat3, degrees: f64, extent: f64) -> View {
    let lens = Lens::Perspective { fov_x: degrees.to_radians() };
    let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
    View { eye, world_from_eye, lens, size: [320, 180], near: extent / 1e4, tolerance }
}

fn orthographic(eye: DVec3, world_from_eye: glam::DMat3, width: f64) -> View {
    let view = perspective(eye, world_from_eye, 90.0, width);
    View { lens: Lens::Orthographic { width, far: 1e9 }, ..view }
}

/// Whether all samples are in the frustum for certain.
pub fn sees_everything(field: &Field, view: &View) -> bool {
    let [w, h] = field.size().map(|n| f64::from(n - 1));
    let range = field.statistics();
    let bounds = cuesta::view::Aabb {
        min: field.world_at(0.0, 0.0, range.min.into()),
        max: field.world_at(w, h, range.max.into()),
    };
    view.frustum().contains(&bounds) == Containment::Inside
}

/// The pairs counted here the plain way.
#[test]
fn any_two_values_of_two_settings_meet() {
    for entry in cuesta::lod::TECHNIQUES {
        let rows = pairwise(entry.settings);
        let product: usize = entry.settings.iter().map(|setting| values(setting).len()).product();
        println!("{}: {} of {product} combinations", entry.name, rows.len());
        assert!(rows.len() <= product && rows.iter().all(|row| row.len() == entry.settings.len()));
        let all: Vec<_> = entry.settings.iter().flat_map(choices).collect();
        for (one, other) in all.iter().flat_map(|one| all.iter().map(move |other| (one, other))) {
            let may_meet = one == other || one.0 != other.0;
            let meet = rows.iter().any(|row| row.contains(one) && row.contains(other));
            assert_eq!(meet, may_meet, "{}: {one:?} and {other:?}", entry.name);
        }
    }
}

#[test]
fn every_field_is_once_seen_whole_and_once_in_part() {
    for (name, field) in fields() {
        let whole = views(&field).iter().filter(|(_, view)| sees_everything(&field, view)).count();
        assert!((1..8).contains(&whole), "{name}: seen whole in {whole} views");
    }
}
