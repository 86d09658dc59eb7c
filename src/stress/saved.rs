//! Counter-examples: the field, the view, the mesh and the picture of a failure, and the command that draws it again.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use image::ImageFormat;

use super::case::Kind;
use super::finding::Finding;
use super::forms::Form;
use super::invariants::Violation;
use super::{ImageChecker, Trial};
use crate::draw::layout::Frame;
use crate::draw::{DrawList, expand};
use crate::height::Field;
use crate::height::save::{replace, save};
use crate::height::surface::Triangle;
use crate::measure::watertight::write_ply;
use crate::view::{Lens, Metric, View};

/// The command that runs a trial again.
pub fn command(trial: &Trial) -> String {
    let technique = trial.form.as_ref().map(|form| {
        let variant = form.variant.map(|name| format!(":{name}")).unwrap_or_default();
        format!(" --technique {}{variant}", form.entry.name)
    });
    format!(
        "cuesta stress --family {} --case '{}'{}",
        trial.case.family,
        trial.case.name,
        technique.unwrap_or_default()
    )
}

/// Saves what a finding broke on, if a field and a view are to blame, and returns the files.
pub fn counter_example(
    folder: &Path,
    trial: &Trial,
    finding: &Finding,
    eye: Option<&mut dyn ImageChecker>,
) -> Result<Vec<PathBuf>> {
    let (Some(form), Some(violation)) = (&trial.form, &finding.violation) else { return Ok(Vec::new()) };
    let field = match &trial.case.kind {
        Kind::Terrain(terrain) => terrain().field,
        Kind::Flight(flight) => flight().field,
        Kind::Each(_) | Kind::Alone(..) => return Ok(Vec::new()),
    };
    let name = file_name(&[trial.case.family, trial.case.name, &form.name, finding.check, violation.view.0]);
    let file = |extension: &str| folder.join(format!("{name}.{extension}"));
    let (terrain, text, mesh, picture) = (file("tif"), file("txt"), file("ply"), file("png"));
    save(&field, &terrain)?;
    let (mesh_of, bits) = mesh_of(&field, form, &violation.view.1);
    let written = |path: &Path| path.display().to_string();
    replace(&mesh, |out| write_ply(&field, &mesh_of, bits, out)).with_context(|| written(&mesh))?;
    replace(&text, |out| writeln!(out, "{}", describe(&terrain, form, violation, trial)))
        .with_context(|| written(&text))?;
    let mut files = vec![terrain, text, mesh];
    if let Some(drawn) = eye.and_then(|eye| eye.picture(&field, form, &violation.view.1)) {
        replace(&picture, |out| drawn.write_to(out, ImageFormat::Png).map_err(io::Error::other))
            .with_context(|| written(&picture))?;
        files.push(picture);
    }
    Ok(files)
}

/// The triangles of a form in a view, and how many fraction bits their corners have.
fn mesh_of(field: &Arc<Field>, form: &Form, view: &View) -> (Vec<Triangle>, u32) {
    let mut technique = (form.entry.build)(Arc::clone(field), &form.settings);
    let mut list = DrawList::default();
    technique.select(view, &mut list);
    let frame = Frame::placing(field, view);
    let (surface, skirts) = (
        expand::triangles(field, &frame, technique.resident(), &list),
        expand::skirts(field, &frame, technique.resident(), &list),
    );
    (surface.iter().chain(&skirts).map(|drawn| drawn.corners).collect(), list.fraction_bits)
}

/// What failed, and the commands that show it.
fn describe(terrain: &Path, form: &Form, violation: &Violation, trial: &Trial) -> String {
    let view = &violation.view.1;
    let terrain = terrain.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    let metric = if view.tolerance.metric == Metric::Certified { "certified" } else { "paper" };
    format!(
        "{violation}\n\n{}\ncuesta render {terrain} {} --tolerance {} --metric {metric} {} --measure -o again.png",
        command(trial),
        form.arguments(),
        view.tolerance.px,
        arguments(view),
    )
}

/// A view as it is asked for on the command line.
pub fn arguments(view: &View) -> String {
    let [yaw, pitch, roll] = angles(view);
    let lens = match view.lens {
        Lens::Perspective { fov_x } => format!("--fov {}", fov_x.to_degrees()),
        Lens::Orthographic { width, .. } => format!("--ortho {width}"),
    };
    let ([x, y, z], [w, h]) = (view.eye.to_array(), view.size);
    format!("--eye={x},{y},{z} --yaw={yaw} --pitch={pitch} --roll={roll} {lens} --size {w}x{h} --near {}", view.near)
}

/// Yaw, pitch and roll of a view, degrees: [`View::turned`] gives its rotation back.
pub fn angles(view: &View) -> [f64; 3] {
    let forward = view.forward();
    // Straight up or down every heading will do: the roll says the rest.
    let is_steep = forward.x.hypot(forward.z) < 1e-9;
    let yaw = if is_steep { 0.0 } else { forward.z.atan2(forward.x).to_degrees() };
    let pitch = forward.y.clamp(-1.0, 1.0).asin().to_degrees();
    let level = View::turned(yaw, pitch, 0.0);
    let right = level.transpose() * view.world_from_eye.x_axis;
    [yaw, pitch, -right.y.atan2(right.x).to_degrees()]
}

/// A file's name of words.
fn file_name(words: &[&str]) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' };
    words.join("-").chars().map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stress::views::views;

    #[test]
    fn angles_give_the_rotation_back() {
        let field = crate::stress::fields::hills([65, 65], [10.0; 2], 300.0);
        for (name, view) in views(&field) {
            let [yaw, pitch, roll] = angles(&view);
            let again = View::turned(yaw, pitch, roll);
            let apart = (again - view.world_from_eye).to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
            assert!(apart < 1e-7, "{name}: {yaw} {pitch} {roll}: {apart}");
        }
    }
}
