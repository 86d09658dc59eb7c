//! Tests of the draw list's execution: resident, streamed and uploaded explicit geometry, as lists and strips.

use std::sync::Arc;

use cuesta::internal::draw::{
    Draw, DrawKinds, DrawList, ExplicitVertex, Geometry, Instance, Limits, Normals, PipelineRequirements, Source,
    Submission, Topology, Upload, VertexNormals, normals,
};
use cuesta::internal::height::{Field, rtin};
use cuesta::internal::lod::Technique;
use cuesta::internal::view::View;

use super::{aslant, mountains, on_device, render, technique};

/// A technique that draws all samples as explicit vertices, delivered in one of several ways.
pub struct Explicit {
    mesh: Geometry,
    resident: Geometry,
    normals: Vec<VertexNormals>,
    way: Way,
}

/// Delivery of the geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    Resident,
    Streamed,
    /// Resident geometry, wrong at first and overwritten by uploads before it is drawn.
    Uploaded,
    /// Streamed, one strip per row of cells.
    Strips,
    /// Resident with vertex normals, wrong at first and overwritten by uploads before it is drawn.
    Lit,
    /// Streamed with vertex normals.
    StreamedLit,
}

impl Way {
    fn is_lit(self) -> bool {
        matches!(self, Way::Lit | Way::StreamedLit)
    }
}

impl Explicit {
    pub fn new(field: &Field, way: Way) -> Self {
        let [w, h] = field.size().map(|n| n as i32);
        let vertices = (0..h).flat_map(|z| (0..w).map(move |x| [x, z]));
        let vertices: Vec<_> = vertices
            .map(|[x, z]| {
                let height = field.height(x as u32, z as u32);
                // Morphed half way between two wrong heights; exact in f32 for multiples of 1/2.
                ExplicitVertex {
                    position: [x, z],
                    height: height - 64.0,
                    target: height + 64.0,
                    morph: 0.5,
                    ..ExplicitVertex::default()
                }
            })
            .collect();
        let index = |[x, z]: [i32; 2]| (z * w + x) as u32;
        let cells = (0..h - 1).flat_map(|j| (0..w - 1).flat_map(move |i| rtin::cell(i, j)));
        let indices: Vec<u32> = match way {
            Way::Strips => {
                (0..h - 1).flat_map(|j| (0..w).flat_map(move |i| [index([i, j]), index([i, j + 1])])).collect()
            }
            _ => cells.flatten().map(index).collect(),
        };
        let mesh = Geometry { vertices, indices, ..Geometry::default() };
        let resident = match way {
            Way::Resident => mesh.clone(),
            Way::Uploaded => Geometry {
                vertices: vec![ExplicitVertex::default(); mesh.vertices.len()],
                indices: vec![0; mesh.indices.len()],
                ..Geometry::default()
            },
            Way::Lit => Geometry { normals: vec![VertexNormals::default(); mesh.vertices.len()], ..mesh.clone() },
            Way::Streamed | Way::Strips | Way::StreamedLit => Geometry::default(),
        };
        let of_vertex = |vertex: &ExplicitVertex| {
            let [x, z] = vertex.position.map(|n| n as u32);
            let normal = normals::pack(field.normal(x, z));
            VertexNormals { normal, target: normal, second_target: 0 }
        };
        let normals = if way.is_lit() { mesh.vertices.iter().map(of_vertex).collect() } else { Vec::new() };
        Self { mesh, resident, normals, way }
    }
}

impl Technique for Explicit {
    fn resident(&self) -> &Geometry {
        &self.resident
    }

    fn limits(&self) -> Limits {
        let bytes = size_of_val(self.mesh.vertices.as_slice()) + size_of_val(self.mesh.indices.as_slice());
        let bytes = bytes.max(size_of_val(self.normals.as_slice()));
        Limits {
            draws: 1000,
            instances: 1,
            vertices: self.mesh.vertices.len(),
            normals: self.normals.len(),
            indices: self.mesh.indices.len(),
            upload_bytes: bytes,
        }
    }

    fn select(&mut self, _: &View, list: &mut DrawList) {
        list.instances.push(Instance::default());
        let (source, topology) = match self.way {
            Way::Resident | Way::Uploaded | Way::Lit => (Source::Resident, Topology::Triangles),
            Way::Streamed | Way::StreamedLit => (Source::Streamed, Topology::Triangles),
            Way::Strips => (Source::Streamed, Topology::Strip),
        };
        let row = 2 * (self.mesh.vertices.last().unwrap().position[0] as usize + 1);
        let step = if self.way == Way::Strips { row } else { self.mesh.indices.len() };
        for first in (0..self.mesh.indices.len()).step_by(step) {
            let indices = first as u32..(first + step) as u32;
            list.draws.push(Draw { source, topology, indices, instances: 0..1, first_vertex: 0 });
        }
        if source == Source::Streamed {
            list.streamed = self.mesh.clone();
            list.streamed.normals = self.normals.clone();
        }
        if self.way == Way::Lit {
            list.uploads.push(Upload::Normals(0, self.normals.clone()));
        }
        if self.way == Way::Uploaded {
            list.uploads.push(Upload::Vertices(0, self.mesh.vertices.clone()));
            list.uploads.push(Upload::Indices(0, self.mesh.indices.clone()));
            list.submission = Submission::Direct;
        }
    }

    fn keeps_tolerance(&self) -> bool {
        true
    }

    fn pipeline_requirements(&self) -> PipelineRequirements {
        let normals = if self.way.is_lit() { Normals::Vertices } else { Normals::Texture };
        let draws =
            DrawKinds { triangles: self.way != Way::Strips, strips: self.way == Way::Strips, ..DrawKinds::EXPLICIT };
        PipelineRequirements { draws, normals, ..PipelineRequirements::default() }
    }
}

/// Returns heights in whole metres, so that morphing is exact.
fn whole_metres() -> Arc<Field> {
    let terrain = mountains();
    let heights = (0..terrain.samples().len()).map(|k| terrain.samples().height(k).round()).collect();
    Arc::new(Field::new(
        cuesta::internal::height::Samples::F32(heights),
        terrain.stored(),
        terrain.spacing,
        terrain.holes().clone(),
    ))
}

#[test]
fn explicit_geometry_gives_the_same_image_as_the_lattice() {
    on_device(|gpu| {
        let field = whole_metres();
        let view = aslant(&field, [160, 120], 1.0);
        let truth = render(gpu, &field, technique(&field, "brute-force", &[]).as_mut(), &view);
        for way in [Way::Resident, Way::Streamed, Way::Uploaded] {
            let rendered = render(gpu, &field, &mut Explicit::new(&field, way), &view);
            assert_eq!(rendered.picture, truth.picture, "{way:?}");
        }
    });
}

/// Vertex and texture normals agree at vertices; between them one interpolates normals, the other heights.
#[test]
fn vertex_normals_light_terrain_like_the_normal_texture() {
    on_device(|gpu| {
        let field = whole_metres();
        let view = aslant(&field, [160, 120], 1.0);
        let truth = render(gpu, &field, technique(&field, "brute-force", &[]).as_mut(), &view);
        for way in [Way::Lit, Way::StreamedLit] {
            let lit = render(gpu, &field, &mut Explicit::new(&field, way), &view);
            let (largest, share) = super::difference(&lit.picture, &truth.picture, 20);
            assert!(largest > 0 && share < 0.02, "{way:?}: {largest}, {share}");
        }
    });
}

/// All diagonals of strips run one way: the outline is nearly the same and the number of triangles is equal.
#[test]
fn strips_give_nearly_the_same_image() {
    on_device(|gpu| {
        let field = whole_metres();
        let view = aslant(&field, [160, 120], 1.0);
        let truth = render(gpu, &field, technique(&field, "brute-force", &[]).as_mut(), &view);
        let strips = render(gpu, &field, &mut Explicit::new(&field, Way::Strips), &view);
        assert_eq!(strips.list.triangles(), 2 * 130 * 96);
        assert!(super::difference(&strips.picture, &truth.picture, 40).1 < 0.03);
    });
}
