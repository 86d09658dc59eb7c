//! The numbers over the picture, the help, and short notes: laid out by egui, drawn by [`crate::gpu::passes::hud`].
//!
//! The overlay takes no input. Every frame lays out all characters that may occur. The font texture is therefore
//! complete from the start and never grows while frames are in flight.

use std::sync::Arc;

use egui::{Align2, Color32, Context, FontId, Galley, LayerId, Painter, Pos2, RawInput, Rect, Vec2, ViewportId};

use super::bindings::Binding;
use crate::gpu::passes::hud::Painted;

const TEXT: Color32 = Color32::from_rgb(240, 240, 235);
const FAINT: Color32 = Color32::from_rgb(180, 192, 204);
const TITLE: Color32 = Color32::from_rgb(255, 214, 130);
const SIZE: f32 = 13.0;
const MARGIN: f32 = 8.0;

/// A name and its value.
pub type HudRow = (String, String);

/// Contents of the overlay.
#[derive(Default)]
pub struct Content<'a> {
    /// Statistics.
    pub rows: Vec<HudRow>,
    /// Key bindings to list; `None` if help is off.
    pub help: Option<&'a [Binding]>,
    /// A short note at the bottom.
    pub note: Option<&'a str>,
}

/// Lays the content out for a window of this size in pixels.
pub fn paint(context: &Context, size: [u32; 2], scale: f32, content: &Content) -> Painted {
    let scale = if scale.is_finite() { scale.clamp(0.5, 8.0) } else { 1.0 };
    let screen = Rect::from_min_size(Pos2::ZERO, Vec2::new(size[0] as f32, size[1] as f32) / scale);
    let mut input = RawInput { screen_rect: Some(screen), ..Default::default() };
    input.viewports.entry(ViewportId::ROOT).or_default().native_pixels_per_point = Some(scale);
    context.begin_pass(input);
    let painter = context.layer_painter(LayerId::background());
    let characters: String = (' '..='~').collect();
    let _ = painter.layout_no_wrap(characters, FontId::monospace(SIZE), TEXT);
    let inner = screen.shrink(MARGIN);
    let mut help_area = Rect::NOTHING;
    if let Some(bindings) = content.help {
        let rows: Vec<HudRow> = bindings.iter().map(|row| (row.keys(), row.about.clone())).collect();
        let size = fitting_size(&painter, inner.shrink(SIZE * 1.5), &rows);
        let table = Table::new(&painter, (screen.center(), Align2::CENTER_CENTER), Some("Keys"), &rows, size);
        help_area = table.background;
        table.paint(&painter);
    }
    let size = fitting_size(&painter, inner, &content.rows);
    let table = Table::new(&painter, (inner.min, Align2::LEFT_TOP), None, &content.rows, size);
    // In a small window help hides the statistics.
    if !content.rows.is_empty() && !table.background.intersects(help_area) {
        table.paint(&painter);
    }
    if let Some(note) = content.note {
        let rows = [(note.to_string(), String::new())];
        let at = (inner.center_bottom(), Align2::CENTER_BOTTOM);
        Table::new(&painter, at, None, &rows, fitting_size(&painter, inner, &rows)).paint(&painter);
    }
    let output = context.end_pass();
    let pixels_per_point = output.pixels_per_point;
    Painted {
        textures: output.textures_delta,
        primitives: context.tessellate(output.shapes, pixels_per_point),
        pixels_per_point,
    }
}

fn join_lines(rows: &[HudRow], part: impl Fn(&HudRow) -> &str) -> String {
    rows.iter().map(part).collect::<Vec<_>>().join("\n")
}

/// Returns the font size in points at which a table fits the space, at most the default size.
fn fitting_size(painter: &Painter, space: Rect, rows: &[HudRow]) -> f32 {
    let letter = painter.layout_no_wrap("0".to_string(), FontId::monospace(SIZE), TEXT).size();
    let longest = |part: fn(&HudRow) -> &String| rows.iter().map(|row| part(row).len()).max().unwrap_or(0) as f32;
    let width = (longest(|row| &row.0) + longest(|row| &row.1)) * letter.x + 5.0 * MARGIN;
    let height = rows.len() as f32 * letter.y + 2.0 * MARGIN;
    let scale = (space.width() / width).min(space.height() / height).min(1.0);
    // Steps of half a point limit the number of font sizes in the texture.
    (SIZE * scale * 2.0).floor().max(8.0) / 2.0
}

/// A laid-out table.
struct Table {
    background: Rect,
    title: Option<Arc<Galley>>,
    names: Arc<Galley>,
    values: Arc<Galley>,
    /// Offset of the values from the top left corner inside the margin.
    indent: Vec2,
}

impl Table {
    /// Lays out two columns under an optional title.
    fn new(painter: &Painter, (at, align): (Pos2, Align2), title: Option<&str>, rows: &[HudRow], size: f32) -> Self {
        let lay = |text: String, colour| painter.layout_no_wrap(text, FontId::monospace(size), colour);
        let (names, values) = (lay(join_lines(rows, |row| &row.0), FAINT), lay(join_lines(rows, |row| &row.1), TEXT));
        let title = title.map(|text| lay(text.to_string(), TITLE));
        let head = title.as_ref().map_or(0.0, |galley| galley.size().y * 1.4);
        let gap = if values.size().x > 0.0 { MARGIN * 2.0 } else { 0.0 };
        let indent = Vec2::new(names.size().x + gap, head);
        let inner = Vec2::new(indent.x + values.size().x, head + names.size().y);
        Self { background: align.anchor_size(at, inner + Vec2::splat(2.0 * MARGIN)), title, names, values, indent }
    }

    /// Paints the table on a dark background.
    fn paint(self, painter: &Painter) {
        painter.rect_filled(self.background, 4.0, Color32::from_black_alpha(232));
        let corner = self.background.min + Vec2::splat(MARGIN);
        if let Some(title) = self.title {
            painter.galley(corner, title, TITLE);
        }
        painter.galley(corner + Vec2::new(0.0, self.indent.y), self.names, FAINT);
        painter.galley(corner + self.indent, self.values, TEXT);
    }
}
