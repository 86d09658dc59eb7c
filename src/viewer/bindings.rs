//! What keys and mouse do: one table, from which events are answered and the help is written.

use std::fmt;

use glam::DVec3;
use winit::event::KeyEvent;
use winit::keyboard::{Key, KeyCode, NamedKey, PhysicalKey};

use crate::lod::Techniques;

/// What happens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// While held, the camera moves: right, up, forward.
    Move(DVec3),
    /// While held, the camera moves faster.
    Fast,
    /// The camera turns with the mouse.
    Look,
    /// The camera's speed changes; in orbit its distance, and the width of an orthographic picture.
    Speed,
    /// The next way to move: fly, orbit, walk.
    Camera,
    /// The camera goes back to where it was at the start.
    Home,
    /// This row of the table of techniques draws.
    Technique(usize),
    /// The technique's next variant draws.
    Variant,
    /// The tolerance is multiplied.
    Tolerance(f64),
    /// Edges only, or faces.
    Wireframe,
    /// Colours by level of detail, or back.
    LevelColours,
    /// The next thing that colours say.
    Colour,
    /// What is drawn stays chosen for this view, or follows again.
    Freeze,
    /// The frame goes to a file.
    Screenshot,
    /// Numbers are shown, or not.
    Hud,
    /// Help is shown, or not.
    Help,
    /// The end.
    Quit,
}

/// What makes it happen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger {
    /// The key at this place, whatever it says: for hands that lie on WASD.
    At(KeyCode),
    /// The key that says this.
    Says(&'static str),
    /// A key without a character.
    Named(NamedKey),
    /// The mouse, moved while a button is held.
    Drag,
    /// The mouse's wheel.
    Wheel,
}

/// One row of the table.
#[derive(Clone, Debug)]
pub struct Binding {
    /// Any of these makes it happen.
    pub triggers: Vec<Trigger>,
    /// What happens, in words.
    pub about: String,
    /// What happens.
    pub action: Action,
}

/// Returns the whole table. The digits choose the first nine techniques.
pub fn table(techniques: &Techniques) -> Vec<Binding> {
    use Action as A;
    use Trigger::{At, Drag, Named, Says, Wheel};
    let row = |triggers: &[Trigger], about: &str, action| Binding {
        triggers: triggers.to_vec(),
        about: about.to_string(),
        action,
    };
    let moves = |place, arrow: Option<KeyCode>, about, direction| {
        let triggers: Vec<_> = [Some(place), arrow].into_iter().flatten().map(At).collect();
        row(&triggers, about, A::Move(direction))
    };
    let mut rows = vec![
        moves(KeyCode::KeyW, Some(KeyCode::ArrowUp), "forward", DVec3::Z),
        moves(KeyCode::KeyS, Some(KeyCode::ArrowDown), "back", DVec3::NEG_Z),
        moves(KeyCode::KeyA, Some(KeyCode::ArrowLeft), "left", DVec3::NEG_X),
        moves(KeyCode::KeyD, Some(KeyCode::ArrowRight), "right", DVec3::X),
        moves(KeyCode::KeyE, None, "up", DVec3::Y),
        moves(KeyCode::KeyQ, None, "down", DVec3::NEG_Y),
        row(&[At(KeyCode::ShiftLeft), At(KeyCode::ShiftRight)], "faster", A::Fast),
        row(&[Drag], "look around", A::Look),
        row(&[Wheel], "speed; distance in orbit; width with --ortho", A::Speed),
        row(&[Named(NamedKey::Tab)], "camera: fly, orbit, walk", A::Camera),
        row(&[Named(NamedKey::Home)], "back to the start", A::Home),
    ];
    let digits = [
        (KeyCode::Digit1, KeyCode::Numpad1),
        (KeyCode::Digit2, KeyCode::Numpad2),
        (KeyCode::Digit3, KeyCode::Numpad3),
        (KeyCode::Digit4, KeyCode::Numpad4),
        (KeyCode::Digit5, KeyCode::Numpad5),
        (KeyCode::Digit6, KeyCode::Numpad6),
        (KeyCode::Digit7, KeyCode::Numpad7),
        (KeyCode::Digit8, KeyCode::Numpad8),
        (KeyCode::Digit9, KeyCode::Numpad9),
    ];
    for (k, (entry, (digit, pad))) in techniques.entries().iter().zip(digits).enumerate() {
        rows.push(row(&[At(digit), At(pad)], &format!("technique: {}", entry.name), A::Technique(k)));
    }
    rows.extend([
        row(&[Says("v")], "next variant of the technique", A::Variant),
        row(&[Says("+"), Says("=")], "tolerance up: coarser", A::Tolerance(std::f64::consts::SQRT_2)),
        row(&[Says("-")], "tolerance down: finer", A::Tolerance(std::f64::consts::FRAC_1_SQRT_2)),
        row(&[Says("f")], "wireframe", A::Wireframe),
        row(&[Says("l")], "level colours", A::LevelColours),
        row(&[Says("c")], "next colours", A::Colour),
        row(&[Says("z")], "freeze the selection", A::Freeze),
        row(&[Says("p"), Named(NamedKey::F12)], "screenshot", A::Screenshot),
        row(&[Says("u")], "numbers on or off", A::Hud),
        row(&[Says("h"), Named(NamedKey::F1)], "this help", A::Help),
        row(&[Named(NamedKey::Escape)], "quit", A::Quit),
    ]);
    rows
}

impl Trigger {
    fn is(&self, event: &KeyEvent) -> bool {
        match self {
            Trigger::At(code) => event.physical_key == PhysicalKey::Code(*code),
            Trigger::Says(text) => matches!(&event.logical_key, Key::Character(c) if c.to_lowercase() == *text),
            Trigger::Named(name) => event.logical_key == Key::Named(*name),
            Trigger::Drag | Trigger::Wheel => false,
        }
    }
}

impl fmt::Display for Trigger {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Trigger::At(code) => {
                let name = format!("{code:?}");
                let parts = ["Key", "Digit", "Arrow"];
                let name = parts.iter().find_map(|part| name.strip_prefix(part)).unwrap_or(&name);
                f.write_str(name)
            }
            Trigger::Says(text) => f.write_str(&text.to_uppercase()),
            Trigger::Named(NamedKey::Escape) => f.write_str("Esc"),
            Trigger::Named(name) => write!(f, "{name:?}"),
            Trigger::Drag => f.write_str("drag"),
            Trigger::Wheel => f.write_str("wheel"),
        }
    }
}

impl Binding {
    /// Its triggers in words.
    pub fn keys(&self) -> String {
        // The number pad and the right-hand twins do the same as their brothers.
        let position_check = |t: &&Trigger| {
            let name = format!("{t:?}");
            name.contains("Numpad") || name.contains("Right)") && name.contains("Shift")
        };
        let keys = self.triggers.iter().filter(|t| !position_check(t)).map(Trigger::to_string);
        keys.map(|key| key.replace("ShiftLeft", "Shift")).collect::<Vec<_>>().join("  ")
    }
}

/// What a key does.
pub fn of_key(table: &[Binding], event: &KeyEvent) -> Option<Action> {
    table.iter().find(|row| row.triggers.iter().any(|t| t.is(event))).map(|row| row.action)
}

/// What something without a key does.
pub fn of(table: &[Binding], trigger: Trigger) -> Option<Action> {
    table.iter().find(|row| row.triggers.contains(&trigger)).map(|row| row.action)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_trigger_means_one_thing_and_every_technique_has_a_key() {
        let rows = table(&Techniques::built_in());
        let triggers: Vec<_> = rows.iter().flat_map(|row| &row.triggers).collect();
        for (k, trigger) in triggers.iter().enumerate() {
            assert!(!triggers[..k].contains(trigger), "{trigger} occurs twice");
        }
        let techniques = rows.iter().filter(|row| matches!(row.action, Action::Technique(_))).count();
        assert_eq!(techniques, Techniques::built_in().entries().len());
        assert!(rows.iter().all(|row| !row.keys().is_empty() && !row.about.is_empty()));
    }
}
