//! Saves counter-examples: field, view, mesh and image of a failure, and the command that draws it again.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use image::ImageFormat;

use super::case::Kind;
use super::case_run::CaseRun;
use super::finding::Finding;
use super::forms::TechniqueConfig;
use super::image_checker::ImageChecker;
use super::invariants::Violation;
use crate::draw::layout::Frame;
use crate::draw::{DrawList, expand};
use crate::height::Field;
use crate::height::save::{replace, save};
use crate::height::surface::Triangle;
use crate::measure::watertight::write_ply;
use crate::view::{Lens, Metric, View};

/// Returns the command that repeats a run.
pub fn command(run: &CaseRun) -> String {
    let technique = run.config.as_ref().map(|config| {
        let variant = config.variant.map(|name| format!(":{name}")).unwrap_or_default();
        format!(" --technique {}{variant}", config.entry.name)
    });
    format!("cuesta stress --family {} --case '{}'{}", run.case.family, run.case.name, technique.unwrap_or_default())
}

/// Saves the field and view of a violation and returns the files; none if the finding has no violation.
pub fn counter_example(
    folder: &Path,
    run: &CaseRun,
    finding: &Finding,
    checker: Option<&mut dyn ImageChecker>,
) -> Result<Vec<PathBuf>> {
    let (Some(config), Some(violation)) = (&run.config, &finding.violation) else { return Ok(Vec::new()) };
    let field = match &run.case.kind {
        Kind::Terrain(terrain) => terrain().field,
        Kind::Flight(flight) => flight().field,
        Kind::PerTechnique(_) | Kind::Standalone(..) => return Ok(Vec::new()),
    };
    let name = file_name(&[run.case.family, run.case.name, &config.name, finding.check, violation.view.0]);
    let file = |extension: &str| folder.join(format!("{name}.{extension}"));
    let (terrain, text, mesh, picture) = (file("tif"), file("txt"), file("ply"), file("png"));
    save(&field, &terrain)?;
    let (mesh_of, bits) = mesh_of(&field, config, &violation.view.1);
    let path_text = |path: &Path| path.display().to_string();
    replace(&mesh, |out| write_ply(&field, &mesh_of, bits, out)).with_context(|| path_text(&mesh))?;
    replace(&text, |out| writeln!(out, "{}", describe(&terrain, config, violation, run)))
        .with_context(|| path_text(&text))?;
    let mut files = vec![terrain, text, mesh];
    if let Some(drawn) = checker.and_then(|checker| checker.picture(&field, config, &violation.view.1)) {
        replace(&picture, |out| drawn.write_to(out, ImageFormat::Png).map_err(io::Error::other))
            .with_context(|| path_text(&picture))?;
        files.push(picture);
    }
    Ok(files)
}

/// Returns the triangles of a configuration in a view, and the fraction bits of their corners.
fn mesh_of(field: &Arc<Field>, config: &TechniqueConfig, view: &View) -> (Vec<Triangle>, u32) {
    let mut technique = (config.entry.build)(Arc::clone(field), &config.settings);
    let mut list = DrawList::default();
    technique.select(view, &mut list);
    let frame = Frame::placing(field, view);
    let (surface, skirts) = (
        expand::triangles(field, &frame, technique.resident(), &list),
        expand::skirts(field, &frame, technique.resident(), &list),
    );
    (surface.iter().chain(&skirts).map(|drawn| drawn.corners).collect(), list.fraction_bits)
}

/// Describes a violation and gives the commands that repeat it.
fn describe(terrain: &Path, config: &TechniqueConfig, violation: &Violation, run: &CaseRun) -> String {
    let view = &violation.view.1;
    let terrain = terrain.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    let metric = if view.tolerance.metric == Metric::Certified { "certified" } else { "paper" };
    format!(
        "{violation}\n\n{}\ncuesta render {terrain} {} --tolerance {} --metric {metric} {} --measure -o again.png",
        command(run),
        config.arguments(),
        view.tolerance.px,
        arguments(view),
    )
}

/// Returns the command-line arguments of a view.
pub fn arguments(view: &View) -> String {
    let [yaw, pitch, roll] = angles(view);
    let lens = match view.lens {
        Lens::Perspective { fov_x } => format!("--fov {}", fov_x.to_degrees()),
        Lens::Orthographic { width, .. } => format!("--ortho {width}"),
    };
    let ([x, y, z], [w, h]) = (view.eye.to_array(), view.size);
    format!("--eye={x},{y},{z} --yaw={yaw} --pitch={pitch} --roll={roll} {lens} --size {w}x{h} --near {}", view.near)
}

/// Returns yaw, pitch and roll of a view, degrees: the inverse of [`View::turned`].
pub fn angles(view: &View) -> [f64; 3] {
    let forward = view.forward();
    // Looking straight up or down, yaw is arbitrary; roll holds the rest.
    let is_steep = forward.x.hypot(forward.z) < 1e-9;
    let yaw = if is_steep { 0.0 } else { forward.z.atan2(forward.x).to_degrees() };
    let pitch = forward.y.clamp(-1.0, 1.0).asin().to_degrees();
    let level = View::turned(yaw, pitch, 0.0);
    let right = level.transpose() * view.world_from_eye.x_axis;
    [yaw, pitch, -right.y.atan2(right.x).to_degrees()]
}

/// Joins words to a file name.
fn file_name(words: &[&str]) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' };
    words.join("-").chars().map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stress::views::views;

    #[test]
    fn angles_reproduce_the_rotation() {
        let field = crate::stress::fields::hills([65, 65], [10.0; 2], 300.0);
        for (name, view) in views(&field) {
            let [yaw, pitch, roll] = angles(&view);
            let again = View::turned(yaw, pitch, roll);
            let apart = (again - view.world_from_eye).to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
            assert!(apart < 1e-7, "{name}: {yaw} {pitch} {roll}: {apart}");
        }
    }
}
