//! Random views through every technique in sequence: lists keep to their field and limits.

use std::sync::{Arc, LazyLock};

use cuesta::internal::cli::scene::ViewArgs;
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::{DrawList, expand};
use cuesta::internal::height::bezier::{Bezier, LAYERS};
use cuesta::internal::height::{Field, Holes, Samples, synth};
use cuesta::internal::lod::Techniques;
use cuesta::internal::stress::forms::{TechniqueConfig, with_each_word};
use cuesta::internal::view::{Metric, Tolerance, View};
use fastrand::Rng;

use super::fuzz;

/// One view in numbers. The `pick` of the first one in a sequence chooses the technique and the field.
#[derive(Clone, Debug)]
pub struct Pose {
    pick: usize,
    eye: [f64; 3],
    look: Option<[f64; 3]>,
    angles: [f64; 3],
    fov: f64,
    size: [u32; 2],
    near: Option<f64>,
    ortho: Option<f64>,
    tolerance: Tolerance,
    time_s: f64,
}

/// Fields that are difficult in different ways.
pub static FIELDS: LazyLock<Vec<Arc<Field>>> = LazyLock::new(|| {
    let terrain = |kind, size| synth::synth(kind, size, 3);
    let mut spaced = terrain(synth::Kind::Fractal, [33, 17]);
    spaced.spacing = [1e-3, 1e5];
    let mut far = terrain(synth::Kind::Spike, [17, 21]);
    far.origin = [1e7, -6.4e6];
    let mut holes = Holes::none(25);
    (5..12).for_each(|k| holes.insert(k));
    let holed = Field::new(Samples::F32((0..25).map(|k| (k * k % 7) as f32).collect()), [5, 5], [1.0; 2], holes);
    let smallest = Field::new(Samples::F32(vec![0.0, 1e7, -1e7, 1e-30]), [2, 2], [3.0, 0.5], Holes::none(4));
    let tiled = terrain(synth::Kind::Checker, [9, 7]).tiled([3, 5]);
    [spaced, far, holed, smallest, tiled, terrain(synth::Kind::Cliff, [65, 65])].map(Arc::new).to_vec()
});

static ENDLESS: LazyLock<Arc<Field>> = LazyLock::new(|| Arc::new(Field::endless(Arc::new(Bezier::new(1, LAYERS)))));
static FORMS: LazyLock<Vec<TechniqueConfig>> =
    LazyLock::new(|| with_each_word(&Techniques::built_in(), &[]).expect("the table's own"));

/// Returns a number: within the field, at a sample, or far outside.
fn number(random: &mut Rng, scale: f64) -> f64 {
    let sign = if random.bool() { 1.0 } else { -1.0 };
    match random.u8(..8) {
        0 => 0.0,
        1 => sign * 10f64.powi(random.i32(-20..=14)),
        2 if random.bool() => sign * f64::from_bits(random.u64(..0x7ff0 << 48)),
        3 | 4 => (scale * random.f64()).round(),
        _ => scale * (1.4 * random.f64() - 0.2),
    }
}

fn pose(random: &mut Rng, pick: usize) -> Pose {
    let [w, h] = field(pick).size().map(f64::from);
    let spacing = field(pick).spacing;
    let origin = field(pick).origin;
    let point = |random: &mut Rng| {
        [number(random, w) * spacing[0] + origin[0], number(random, 500.0), number(random, h) * spacing[1] + origin[1]]
    };
    let positive = |random: &mut Rng, scale| number(random, scale).abs().max(f64::MIN_POSITIVE);
    Pose {
        pick,
        eye: point(random),
        look: random.bool().then(|| point(random)),
        angles: [0; 3].map(|_| number(random, 360.0)),
        fov: if random.bool() { 60.0 } else { number(random, 180.0) },
        size: [0; 2].map(|_| if random.bool() { random.u32(1..200) } else { 1 << random.u32(..15) }),
        near: random.bool().then(|| positive(random, 1.0)),
        ortho: (random.u8(..4) == 0).then(|| positive(random, 100.0)),
        tolerance: Tolerance {
            px: positive(random, 4.0),
            metric: if random.bool() { Metric::Certified } else { Metric::Paper },
        },
        time_s: number(random, 10.0),
    }
}

fn form(pick: usize) -> &'static TechniqueConfig {
    &FORMS[pick % FORMS.len()]
}

fn field(pick: usize) -> &'static Arc<Field> {
    let is_endless = form(pick).entry.takes_endless && (pick / FORMS.len()).is_multiple_of(16);
    if is_endless { &ENDLESS } else { &FIELDS[pick / FORMS.len() % FIELDS.len()] }
}

impl Pose {
    /// Returns the view, if the command line accepts it.
    fn view(&self, field: &Field) -> Option<View> {
        let point = |[x, y, z]: [f64; 3]| format!("{x:e},{y:e},{z:e}");
        let [yaw, pitch, roll] = self.angles;
        let is_turned = self.look.is_none();
        let arguments = ViewArgs {
            eye: Some(point(self.eye)),
            look: self.look.map(point),
            yaw: is_turned.then_some(yaw),
            pitch: is_turned.then_some(pitch),
            roll,
            fov: self.fov,
            size: self.size,
            near: self.near,
            ortho: self.ortho,
        };
        match arguments.build(field, self.tolerance) {
            Ok(view) => Some(View { time_s: self.time_s, ..view }),
            Err(error) => {
                let error = format!("{error:#}");
                assert!(!error.contains('\n') && error.starts_with("--"), "{error:?}");
                None
            }
        }
    }
}

/// Asserts the invariants of any view and technique: finite triangles inside the field.
pub fn check_list(field: &Field, view: &View, technique: &mut dyn cuesta::internal::lod::Technique) {
    let mut list = DrawList::default();
    technique.select(view, &mut list);
    assert!(list.tolerance_scale >= 1.0, "scale {}", list.tolerance_scale);
    if field.procedural().is_some() {
        return;
    }
    let [last_x, last_z] = field.size().map(|n| (i64::from(n) - 1) << list.fraction_bits);
    let is_inside = |corner: &cuesta::internal::height::surface::Corner| {
        let [x, z] = [corner.x, corner.z].map(i64::from);
        (0..=last_x).contains(&x) && (0..=last_z).contains(&z) && corner.y.is_finite()
    };
    expand::visit_triangles(field, &Frame::placing(field, view), technique.resident(), &list, |drawn| {
        assert!(drawn.corners.iter().all(is_inside), "{:?}", drawn.corners);
    });
}

fn check(poses: &[Pose]) {
    let Some(Pose { pick, .. }) = poses.first() else { return };
    let (form, field) = (form(*pick), field(*pick));
    let Ok(mut technique) = form.entry.prepare(field, &form.settings) else { return };
    for view in poses.iter().filter_map(|pose| pose.view(field)) {
        check_list(field, &view, technique.as_mut());
    }
}

/// Found by the test below: a picture of 2 × 185 pixels, 115° wide, in which no finite tolerance suffices.
#[test]
fn where_no_tolerance_is_wide_enough_none_is_kept() {
    check(&[Pose {
        pick: 1_017_535_600,
        eye: [0.0, 212.0, 456_785.119140625],
        look: Some([190_200.19921875, 204.55113483031053, 0.0]),
        angles: [0.0; 3],
        fov: 115.0,
        size: [2, 185],
        near: None,
        ortho: None,
        tolerance: Tolerance { px: 3.5, metric: Metric::Certified },
        time_s: 7.0,
    }]);
}

#[test]
fn whatever_the_view_a_list_that_fits() {
    let generate = |random: &mut Rng| {
        let pick = random.usize(..1 << 30);
        (0..random.usize(1..6)).map(|_| pose(random, pick)).collect()
    };
    fuzz("views", generate, check);
}
