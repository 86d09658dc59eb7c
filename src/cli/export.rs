//! `cuesta export`: writes the mesh that a technique draws in one view, in world metres.

use std::collections::HashMap;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Result;
use clap::Args;
use glam::DVec3;
use serde::Serialize;
use serde_json::json;

use super::common::{Common, Outcome};
use super::report;
use super::scene::{TerrainArgs, ViewArgs};
use super::technique::TechniqueArgs;
use crate::draw::layout::Frame;
use crate::draw::{DrawList, expand};
use crate::height::save::{Out, replace};
use crate::height::surface::Corner;
use crate::height::{Error, Field, surface};

/// Arguments of `cuesta export`.
#[derive(Args, Debug)]
pub struct ExportArgs {
    /// The height data.
    #[command(flatten)]
    pub terrain: TerrainArgs,
    /// Output file: .ply, .obj or .glb.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// The view.
    #[command(flatten)]
    pub view: ViewArgs,
    /// The technique.
    #[command(flatten)]
    pub technique: TechniqueArgs,
}

#[derive(Serialize)]
struct Exported {
    triangles: usize,
    vertices: usize,
}

/// An indexed mesh.
struct Mesh {
    /// World positions, metres.
    positions: Vec<DVec3>,
    /// Indices of the corners.
    triangles: Vec<[u32; 3]>,
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &ExportArgs) -> Result<Outcome> {
    let write: fn(&Mesh, &mut Out) -> io::Result<()> =
        match args.output.extension().and_then(|e| e.to_str()).map(str::to_lowercase).as_deref() {
            Some("ply") => write_ply,
            Some("obj") => write_obj,
            Some("glb") => write_glb,
            _ => {
                let file = args.output.display().to_string();
                return Err(Error::new(file, "extension", "expected .ply, .obj or .glb").into());
            }
        };
    let field = Arc::new(args.terrain.load(common)?.field);
    let view = args.view.build(&field, args.technique.tolerance()?)?;
    let mut technique = args.technique.build(common, &field)?;
    let mut list = DrawList::default();
    technique.select(&view, &mut list);
    report::warn_of_tolerance(common, list.tolerance_scale);
    let mut mesh = MeshBuilder::new(&field, list.fraction_bits);
    let frame = Frame::placing(&field, &view);
    expand::visit_triangles(&field, &frame, technique.resident(), &list, |t| mesh.add(&t.corners));
    expand::skirts(&field, &frame, technique.resident(), &list).iter().for_each(|t| mesh.add(&t.corners));
    let mesh = mesh.mesh;
    replace(&args.output, |out| write(&mesh, out))
        .map_err(|e| Error::new(args.output.display().to_string(), "file", e))?;
    report::print(common, &Exported { triangles: mesh.triangles.len(), vertices: mesh.positions.len() })?;
    Ok(Outcome::Done)
}

/// Collects triangles into a mesh and merges equal vertices.
struct MeshBuilder<'a> {
    field: &'a Field,
    /// Binary digits of a fraction of a sample in the corners' positions.
    fraction_bits: u32,
    /// Index of each vertex by lattice position (x, z) and the bits of its height.
    known: HashMap<(i32, i32, u32), u32>,
    mesh: Mesh,
}

impl<'a> MeshBuilder<'a> {
    fn new(field: &'a Field, fraction_bits: u32) -> Self {
        Self {
            field,
            fraction_bits,
            known: HashMap::new(),
            mesh: Mesh { positions: Vec::new(), triangles: Vec::new() },
        }
    }

    fn add(&mut self, corners: &surface::Triangle) {
        let triangle = corners.map(|corner| self.vertex(&corner));
        self.mesh.triangles.push(triangle);
    }

    /// Returns the index of a corner's vertex, which is added if it is new.
    fn vertex(&mut self, corner: &Corner) -> u32 {
        let positions = &mut self.mesh.positions;
        *self.known.entry((corner.x, corner.z, corner.y.to_bits())).or_insert_with(|| {
            positions.push(surface::world(self.field, corner, self.fraction_bits));
            positions.len() as u32 - 1
        })
    }
}

/// Writes binary PLY with f64 positions.
fn write_ply(mesh: &Mesh, out: &mut Out) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment x east, y up, z south; world metres")?;
    writeln!(out, "element vertex {}", mesh.positions.len())?;
    writeln!(out, "property double x\nproperty double y\nproperty double z")?;
    writeln!(out, "element face {}", mesh.triangles.len())?;
    writeln!(out, "property list uchar uint vertex_indices\nend_header")?;
    for position in &mesh.positions {
        for value in position.to_array() {
            out.write_all(&value.to_le_bytes())?;
        }
    }
    for triangle in &mesh.triangles {
        out.write_all(&[3])?;
        for index in triangle {
            out.write_all(&index.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Writes Wavefront OBJ, whose indices start at 1.
fn write_obj(mesh: &Mesh, out: &mut Out) -> io::Result<()> {
    writeln!(out, "# x east, y up, z south; world metres")?;
    for p in &mesh.positions {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for [a, b, c] in mesh.triangles.iter().map(|t| t.map(|k| k + 1)) {
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

/// Writes binary glTF 2.0. Positions are f32, relative to the translation of their node, which JSON stores as f64.
///
/// # Errors
/// If the file exceeds 4 GiB, the format's limit, or writing fails.
fn write_glb(mesh: &Mesh, out: &mut Out) -> io::Result<()> {
    let low = mesh.positions.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let high = mesh.positions.iter().copied().reduce(DVec3::max).unwrap_or_default();
    let relative: Vec<[f32; 3]> = mesh.positions.iter().map(|p| (*p - low).as_vec3().to_array()).collect();
    let positions: &[u8] = bytemuck::cast_slice(&relative);
    let indices: &[u8] = bytemuck::cast_slice(&mesh.triangles);
    let document = json!({
        "asset": { "version": "2.0", "generator": "cuesta" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "translation": low.to_array() }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "buffers": [{ "byteLength": positions.len() + indices.len() }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": positions.len(), "target": 34962 },
            { "buffer": 0, "byteOffset": positions.len(), "byteLength": indices.len(), "target": 34963 },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": relative.len(), "type": "VEC3",
              "min": [0.0, 0.0, 0.0], "max": (high - low).as_vec3().to_array() },
            { "bufferView": 1, "componentType": 5125, "count": 3 * mesh.triangles.len(), "type": "SCALAR" },
        ],
    });
    let mut text = serde_json::to_vec(&document)?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + positions.len() + indices.len();
    let word = |value: usize| u32::try_from(value).map_err(|_| io::Error::other("a GLB file holds at most 4 GiB"));
    out.write_all(b"glTF")?;
    for value in [2, word(total)?, word(text.len())?] {
        out.write_all(&value.to_le_bytes())?;
    }
    out.write_all(b"JSON")?;
    out.write_all(&text)?;
    out.write_all(&word(positions.len() + indices.len())?.to_le_bytes())?;
    out.write_all(b"BIN\0")?;
    out.write_all(positions)?;
    out.write_all(indices)?;
    Ok(())
}
