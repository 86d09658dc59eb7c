//! A technique from outside the crate: a uniform grid of every n-th sample, as coarse as the tolerance allows in view.
//!
//! `cargo run --release --example own_technique` compares it with a built-in technique. With arguments it is the program
//! `cuesta` with one more technique: `… -- render demo --technique uniform-grid -o grid.png`.

use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;

use cuesta::draw_list::{Draw, Geometry, Instance, LatticeVertex, Limits, Source, Topology};
use cuesta::glam::DVec3;
use cuesta::heights::{self, Corner, Field, Triangle};
use cuesta::techniques::{Entry, Setting, Technique, Techniques, Values};
use cuesta::{Aabb, Containment, DrawList, View, accuracy, program};

/// The row of the table of techniques: it feeds the command line, the benchmark and the window.
static UNIFORM_GRID: Entry = Entry {
    name: "uniform-grid",
    about: "every n-th sample, n a power of two: as coarse as the tolerance allows in view",
    paper: "none",
    variants: &[],
    settings: &[Setting {
        key: "coarsest",
        values: Values::Number(0.0, 10.0),
        default: "6",
        about: "coarsest level k: every 2^k-th sample",
    }],
    needs: &[],
    max_samples: 1 << 26,
    max_side: 1 << 15,
    takes_endless: false,
    build: |field, settings| Box::new(UniformGrid::new(&field, settings.number("coarsest") as u32)),
};

/// Cells along a side of a block. All blocks share one mesh.
const CELLS: i32 = 64;

struct UniformGrid {
    mesh: Geometry,
    /// The blocks of each level; level k draws every 2^k-th sample.
    levels: Vec<Vec<Block>>,
}

struct Block {
    instance: Instance,
    bounds: Aabb,
    /// Largest vertical distance of the block's triangles from the samples, metres.
    error_m: f64,
}

impl UniformGrid {
    fn new(field: &Field, coarsest: u32) -> Self {
        let side = field.size().into_iter().max().unwrap_or(2) - 1;
        let is_useful = |level: &u32| *level == 0 || (CELLS as u32) << (level - 1) < side;
        let levels = (0..=coarsest).take_while(is_useful).map(|level| blocks(field, level)).collect();
        Self { mesh: grid(), levels }
    }
}

/// Returns the blocks that cover the field at a level.
fn blocks(field: &Field, level: u32) -> Vec<Block> {
    let step = CELLS << level;
    let [columns, rows] = field.size().map(|n| (n as i32 - 1 + step - 1) / step);
    let origins = (0..rows).flat_map(|j| (0..columns).map(move |i| [i * step, j * step]));
    origins.map(|origin| Block::new(field, origin, level)).collect()
}

impl Block {
    fn new(field: &Field, origin: [i32; 2], level: u32) -> Self {
        let instance =
            Instance { origin, cells: CELLS as u32, shift: level as i32, level, batch: level, ..Instance::default() };
        // The renderer moves vertices beyond the last sample onto it.
        let last = field.size().map(|n| n as i32 - 1);
        let corner = |[x, z]: [i32; 2]| {
            let [x, z] = [(origin[0] + (x << level)).min(last[0]), (origin[1] + (z << level)).min(last[1])];
            Corner { x, z, y: field.height(x as u32, z as u32) }
        };
        let triangles = cells().flatten().map(|triangle| triangle.map(corner)).filter(has_area);
        let error_m = triangles.map(|triangle| heights::deviation(field, &triangle)).fold(0.0, f32::max);
        let [first, end] = [corner([0, 0]), corner([CELLS, CELLS])];
        let samples = (first.z..=end.z).flat_map(|z| (first.x..=end.x).map(move |x| [x as u32, z as u32]));
        let positions = || samples.clone().map(|[x, z]| field.world(x, z));
        let min = positions().fold(DVec3::INFINITY, DVec3::min);
        let max = positions().fold(DVec3::NEG_INFINITY, DVec3::max);
        Self { instance, bounds: Aabb { min, max }, error_m: f64::from(error_m) }
    }
}

/// Returns the two triangles of each cell of the mesh, counter-clockwise seen from above.
fn cells() -> impl Iterator<Item = [[[i32; 2]; 3]; 2]> {
    let cell = |[i, j]: [i32; 2]| {
        let [a, b, c, d] = [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]];
        [[a, c, b], [b, c, d]]
    };
    (0..CELLS).flat_map(move |j| (0..CELLS).map(move |i| cell([i, j])))
}

fn has_area([a, b, c]: &Triangle) -> bool {
    (b.z - a.z) * (c.x - a.x) != (b.x - a.x) * (c.z - a.z)
}

fn grid() -> Geometry {
    let positions = (0..=CELLS).flat_map(|z| (0..=CELLS).map(move |x| [x, z]));
    let index = |[x, z]: [i32; 2]| (z * (CELLS + 1) + x) as u32;
    Geometry {
        lattice: positions.map(|position| LatticeVertex { position }).collect(),
        indices: cells().flatten().flatten().map(index).collect(),
        ..Geometry::default()
    }
}

impl Technique for UniformGrid {
    fn resident(&self) -> &Geometry {
        &self.mesh
    }

    fn limits(&self) -> Limits {
        Limits { draws: 1, instances: self.levels[0].len(), ..Limits::default() }
    }

    /// Selects the blocks in view of the coarsest level whose error is allowed in each of them.
    fn select(&mut self, view: &View, list: &mut DrawList) {
        let (frustum, allowance) = (view.frustum(), view.allowance());
        let in_view = |block: &&Block| frustum.contains(&block.bounds) != Containment::Outside;
        let keeps_tolerance = |blocks: &&Vec<Block>| {
            blocks.iter().filter(in_view).all(|block| block.error_m <= allowance.error(&block.bounds))
        };
        // Level 0 draws every sample and has no error.
        let blocks = self.levels.iter().rev().find(keeps_tolerance).unwrap_or(&self.levels[0]);
        list.instances.extend(blocks.iter().filter(in_view).map(|block| block.instance));
        list.draws.push(Draw {
            source: Source::Lattice,
            topology: Topology::Triangles,
            indices: 0..self.mesh.indices.len() as u32,
            instances: 0..list.instances.len() as u32,
            first_vertex: 0,
        });
    }

    fn keeps_tolerance(&self) -> bool {
        true
    }
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let techniques = Techniques::built_in().with(&UNIFORM_GRID);
    if std::env::args().len() > 1 {
        return Ok(program::main(&techniques));
    }
    let field = Arc::new(heights::demo());
    let view = View::builder()
        .eye(DVec3::new(12_800.0, 9000.0, 38_000.0))
        .look_at(DVec3::new(12_800.0, 1000.0, 12_800.0))
        .tolerance_px(32.0)
        .build()?;
    for name in [UNIFORM_GRID.name, "geomipmap"] {
        let mut technique = techniques.prepare(name, &field)?;
        let mut list = DrawList::default();
        technique.select(&view, &mut list);
        let errors = accuracy::errors(&field, &view, technique.resident(), &list);
        let seams = technique.pipeline_requirements().seams;
        let proof = accuracy::prove_list(&field, &view, seams, technique.resident(), &list)?;
        println!("{name}: {} triangles, one surface of {}", list.triangles(), proof.triangles);
        println!("  largest error {:.2} of {} pixels", errors.screen_px.max, view.tolerance.px);
    }
    Ok(ExitCode::SUCCESS)
}
