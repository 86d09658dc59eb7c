//! Bands of a TIFF: heights, colours that encode heights, and opacity, read chunk by chunk.

use std::io::{Read, Seek, SeekFrom};

use super::layout::{Chunk, Layout};
use crate::height::error::Error;
use crate::height::formats::encoding::Encoding;
use crate::height::formats::options::Options;
use crate::height::formats::sample::{Order, SampleType};
use crate::height::formats::terrain_rgb;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// The bands that are read.
pub(super) struct Bands {
    /// One of heights, or three of colours.
    values: Vec<usize>,
    /// The band of opacity; a pixel without opacity has no data.
    alpha: Option<usize>,
    /// The encoding of heights in the colours.
    pub encoding: Option<Encoding>,
    /// A warning about the choice.
    pub warning: Option<String>,
}

impl Bands {
    /// The band that the options name, else colours, else the first band.
    pub fn choose(layout: &Layout, name: &str, options: &Options) -> Result<Self, Error> {
        let (count, sample) = (layout.bands, layout.packing.sample);
        let is_colour = matches!(count, 3 | 4) && sample == SampleType::U8 && layout.packing.bits == 8;
        if is_colour && options.band.is_none() {
            let (values, alpha) = (vec![0, 1, 2], (count == 4).then_some(3));
            return Ok(Self { values, alpha, encoding: Some(terrain_rgb::asked(name, options)?), warning: None });
        }
        let band = match options.band.map(|band| band as usize) {
            Some(band) if !(1..=count).contains(&band) => {
                return Err(Error::new(name, "--band", format!("expected 1 to {count}, found {band}")));
            }
            Some(band) => band - 1,
            None => 0,
        };
        let alpha = layout.alpha.filter(|&alpha| alpha != band);
        let others = count - 1 - usize::from(alpha.is_some());
        let warning = if layout.is_palette {
            Some("the samples are indices into a table of colours; they are read as heights".to_owned())
        } else {
            let is_guess = options.band.is_none() && others > 0;
            is_guess.then(|| format!("the file has {count} bands; heights are band 1 (--band reads another)"))
        };
        Ok(Self { values: vec![band], alpha, encoding: None, warning })
    }

    /// Reads the samples, and the holes where opacity is 0 or a sparse file has no chunk.
    pub fn read(
        &self,
        reader: &mut (impl Read + Seek),
        layout: &Layout,
        name: &str,
        count: usize,
    ) -> Result<(Samples, Holes), Error> {
        let sample = layout.packing.sample;
        let mut samples = if self.encoding.is_some() { Samples::F32(vec![0.0; count]) } else { sample.blank(count) };
        let mut holes = Holes::none(count);
        let bands: Vec<usize> = self.values.iter().copied().chain(self.alpha).collect();
        read(reader, layout, name, &bands, |band, at, row| match (row, &mut samples) {
            (Row::Absent(count), _) => (at..at + count).for_each(|k| holes.insert(k)),
            (Row::Samples(row), _) if band == self.values.len() => {
                zeros(row, sample, at).for_each(|k| holes.insert(k));
            }
            // The three bytes of a colour are a number of 24 bits, which an f32 holds.
            (Row::Samples(row), Samples::F32(heights)) if self.encoding.is_some() => {
                let place = [65536.0, 256.0, 1.0][band];
                heights[at..].iter_mut().zip(row).for_each(|(number, &byte)| *number += f32::from(byte) * place);
            }
            (Row::Samples(row), samples) => sample.store(Order::Little, row, samples, at),
        })?;
        if let (Some(encoding), Samples::F32(heights)) = (self.encoding, &mut samples) {
            heights.iter_mut().for_each(|number| *number = encoding.value(*number as i32));
        }
        Ok((samples, holes))
    }
}

/// Reads a mask: samples where it is 0 become holes.
pub(super) fn read_mask(
    reader: &mut (impl Read + Seek),
    mask: &Layout,
    name: &str,
    holes: &mut Holes,
) -> Result<(), Error> {
    read(reader, mask, name, &[0], |_, at, row| match row {
        Row::Absent(count) => (at..at + count).for_each(|k| holes.insert(k)),
        Row::Samples(row) => zeros(row, mask.packing.sample, at).for_each(|k| holes.insert(k)),
    })
}

/// The samples of a row from `at` on that are 0.
fn zeros(row: &[u8], sample: SampleType, at: usize) -> impl Iterator<Item = usize> {
    let samples = (at..).zip(row.chunks_exact(sample.bytes()));
    samples.filter(|(_, bytes)| bytes.iter().all(|&byte| byte == 0)).map(|(k, _)| k)
}

/// A part of a row of the image.
enum Row<'a> {
    /// Little-endian numbers of the layout's type.
    Samples(&'a [u8]),
    /// As many samples that a sparse file leaves out.
    Absent(usize),
}

/// Visits bands chunk by chunk and row by row: place in `bands`, first sample, row.
fn read(
    reader: &mut (impl Read + Seek),
    layout: &Layout,
    name: &str,
    bands: &[usize],
    mut visit: impl FnMut(usize, usize, Row),
) -> Result<(), Error> {
    let width = layout.size[0] as usize;
    for chunk in &layout.chunks {
        // The bands in this chunk: place in `bands`, place in a pixel of the chunk.
        let here = (0..).zip(bands).filter(|&(_, &band)| !layout.is_planar || band == chunk.plane);
        let here: Vec<(usize, usize)> = here.map(|(k, &band)| (k, if layout.is_planar { 0 } else { band })).collect();
        let rows = (chunk.at[1]..chunk.at[1] + chunk.size[1]).map(|row| row * width + chunk.at[0]);
        if here.is_empty() {
            continue;
        }
        if chunk.bytes[1] == 0 {
            rows.for_each(|at| here.iter().for_each(|&(k, _)| visit(k, at, Row::Absent(chunk.size[0]))));
            continue;
        }
        let data = unpack(reader, layout, chunk).map_err(|what| Error::new(name, layout.name(chunk), what))?;
        let mut samples = Vec::new();
        for (at, row) in rows.zip({ data }.chunks_exact_mut(layout.row_bytes())) {
            layout.packing.decode(row);
            for &(k, band) in &here {
                if layout.packing.is_plain() {
                    visit(k, at, Row::Samples(&row[..chunk.size[0] * layout.packing.sample.bytes()]));
                } else {
                    samples.clear();
                    layout.packing.extract(row, band, chunk.size[0], &mut samples);
                    visit(k, at, Row::Samples(&samples));
                }
            }
        }
    }
    Ok(())
}

fn unpack(reader: &mut (impl Read + Seek), layout: &Layout, chunk: &Chunk) -> Result<Vec<u8>, String> {
    let [at, count] = chunk.bytes;
    let mut packed = vec![0; count as usize];
    let read = reader.seek(SeekFrom::Start(at)).and_then(|_| reader.read_exact(&mut packed));
    read.map_err(|e| e.to_string())?;
    if layout.is_bit_reversed {
        packed.iter_mut().for_each(|byte| *byte = byte.reverse_bits());
    }
    layout.codec.unpack(packed, layout.min_bytes(chunk), layout.max_bytes(chunk))
}
