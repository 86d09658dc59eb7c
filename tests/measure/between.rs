//! Lists whose vertices lie between samples.

use std::sync::Arc;

use cuesta::internal::draw::DrawList;
use cuesta::internal::draw::expand::Drawn;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::measure::pop::{self, State};
use cuesta::internal::measure::watertight::{self, Kind};
use cuesta::internal::measure::{economy, geometric};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};

use super::{drawn, select, technique};

fn terrain() -> Arc<Field> {
    let mut field = synth::synth(synth::Kind::Fractal, [201, 170], 3);
    field.spacing = [20.0, 20.0];
    Arc::new(field)
}

fn view(field: &Field, x: f64) -> View {
    let eye = field.world_at(x, 150.0, f64::from(field.statistics().max) + 100.0);
    View {
        eye,
        world_from_eye: View::looking_along(field.world(120, 60) - eye),
        lens: Lens::Perspective { fov_x: 1.2 },
        size: [320, 200],
        near: 1.0,
        tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
        time_s: 0.0,
    }
}

/// The same list, its vertices told in 64ths of a sample.
fn in_parts(list: &DrawList) -> DrawList {
    let mut finer = list.clone();
    finer.fraction_bits = 6;
    finer.streamed.vertices.iter_mut().for_each(|vertex| vertex.position = vertex.position.map(|n| n << 6));
    finer
}

#[test]
fn told_in_parts_of_samples_the_same_list_measures_the_same() {
    let field = terrain();
    let views = [8.0, 9.0].map(|x| view(&field, x));
    let mut strips = technique(&field, "sorted-strips", &["level=uniform", "edge=10"]);
    let lists = views.each_ref().map(|view| select(&mut *strips, view));
    let finer = lists.each_ref().map(in_parts);
    let resident = strips.resident();
    let [errors, errors_finer] =
        [&lists, &finer].map(|lists| geometric::errors(&field, &views[1], resident, &lists[1]));
    assert!(errors.screen_px.max > 1.0 && errors == errors_finer, "{errors:?} {errors_finer:?}");
    let pop = |lists: &[DrawList; 2]| {
        let [before, after] = [0, 1].map(|k| State { view: &views[k], resident, list: &lists[k] });
        pop::pop(&field, before, after)
    };
    assert!(pop(&lists).max_px > 0.5 && pop(&lists) == pop(&finer));
    let depth = vec![0.0; 320 * 200];
    let [sizes, sizes_finer] =
        [&lists, &finer].map(|lists| economy::triangles(&field, &views[1], resident, &lists[1], &depth));
    assert_eq!(sizes, sizes_finer);
    let [proof, proof_finer] = [&lists, &finer].map(|lists| {
        let proof =
            watertight::prove_list(&field, &views[1], strips.pipeline_requirements().seams, resident, &lists[1])
                .unwrap();
        (proof.triangles, proof.doubled_area)
    });
    assert_eq!(proof, proof_finer);
}

/// Returns the index of a triangle's corner at a position, if any.
fn corner_at(triangle: &Drawn, at: [i32; 2]) -> Option<usize> {
    triangle.corners.iter().position(|c| [c.x, c.z] == at)
}

#[test]
fn faults_of_parts_of_a_sample_are_found() {
    let field = terrain();
    let view = view(&field, 8.0);
    let mut strips = technique(&field, "sorted-strips", &["level=uniform", "edge=10", "blend=end"]);
    let list = select(&mut *strips, &view);
    let triangles = drawn(&field, &view, &*strips, &list);
    let prove = |triangles: &[Drawn]| {
        watertight::prove(&field, &view.frustum(), triangles, list.fraction_bits).map_err(|why| why.kind)
    };
    prove(&triangles).unwrap();
    let mut found = Vec::new();
    for vertex in list.streamed.vertices.iter().filter(|vertex| vertex.morph > 0.1 && vertex.morph < 0.9).step_by(5) {
        let around: Vec<_> =
            (0..triangles.len()).filter(|&k| corner_at(&triangles[k], vertex.position).is_some()).collect();
        // One away from the border, which may lie on it.
        if around.len() < 6 {
            continue;
        }
        let changed = |of: &[usize], change: &dyn Fn(&mut cuesta::internal::height::surface::Corner)| {
            let mut changed = triangles.clone();
            for &k in of {
                let n = corner_at(&changed[k], vertex.position).expect("one of its own");
                change(&mut changed[k].corners[n]);
            }
            prove(&changed).map(|_| ())
        };
        // Moved as a whole it is still one surface; one triangle's corner alone is not.
        assert_eq!(changed(&around, &|corner| corner.x += 1), Ok(()));
        found.push(changed(&around[..1], &|corner| corner.x += 1).expect_err("a gap or an overlap"));
        assert_eq!(changed(&around[..1], &|corner| corner.y = corner.y.next_up()), Err(Kind::Crack));
        let over = if vertex.position[0] > 100 << list.fraction_bits { -50 } else { 50 } << list.fraction_bits;
        assert_eq!(changed(&around, &|corner| corner.x += over), Err(Kind::Fold));
        let mut without = triangles.clone();
        without.swap_remove(around[0]);
        assert_eq!(prove(&without).map(|_| ()), Err(Kind::Gap));
    }
    println!("{found:?}");
    assert!(found.len() > 10);
}

#[test]
fn a_junction_between_samples_is_found() {
    let field = terrain();
    let view = view(&field, 8.0);
    let corner = |x: i32, z: i32| cuesta::internal::height::surface::Corner { x, z, y: 1.0 };
    let [last_x, last_z] = field.size().map(|n| (n as i32 - 1) << 6);
    // The whole field in two triangles, the second one cut at a place of the diagonal that is no sample's.
    let inner = corner(5 * 200, 5 * 169);
    assert!(inner.x % 64 != 0 && inner.z % 64 != 0);
    let (a, b, c, d) = (corner(0, 0), corner(0, last_z), corner(last_x, last_z), corner(last_x, 0));
    let drawn = |corners| Drawn { corners, instance: 0 };
    let whole = [[a, b, c], [a, c, d]].map(drawn);
    let proof = watertight::prove(&field, &view.frustum(), &whole, 6).unwrap();
    assert_eq!(proof.doubled_area, 2 * 200 * 169);
    let cut = [[a, b, c], [a, inner, d], [inner, c, d]].map(drawn);
    let found = watertight::prove(&field, &view.frustum(), &cut, 6).unwrap_err();
    assert_eq!(found.kind, Kind::TJunction, "{found}");
}
