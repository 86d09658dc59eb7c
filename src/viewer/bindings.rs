//! Key and mouse bindings: one table for event handling and for the help overlay.

use std::fmt;

use glam::DVec3;
use winit::event::KeyEvent;
use winit::keyboard::{Key, KeyCode, NamedKey, PhysicalKey};

use crate::lod::Techniques;

/// An action of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Moves the camera while held: right, up, forward.
    Move(DVec3),
    /// Speeds up movement while held.
    Fast,
    /// Turns the camera with the mouse.
    Turn,
    /// Changes the camera's speed; the distance in orbit mode; the image width of an orthographic view.
    Speed,
    /// Switches to the next camera mode: fly, orbit, walk.
    Camera,
    /// Returns the camera to its start.
    Home,
    /// Selects a technique by its index in the table.
    Technique(usize),
    /// Selects the technique's next variant.
    Variant,
    /// Multiplies the tolerance.
    Tolerance(f64),
    /// Toggles wireframe.
    Wireframe,
    /// Toggles colours by level of detail.
    LevelColours,
    /// Selects the next colour mode.
    Colour,
    /// Toggles a frozen draw list, while the camera still moves.
    Freeze,
    /// Saves the next frame to a file.
    Screenshot,
    /// Toggles the statistics.
    Hud,
    /// Toggles the help.
    Help,
    /// Ends the program.
    Quit,
}

/// An input that triggers an action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger {
    /// The key at a physical position, independent of the keyboard layout (WASD).
    Position(KeyCode),
    /// The key that produces a character in the user's layout.
    Character(&'static str),
    /// A key without a character.
    Named(NamedKey),
    /// Mouse movement while a button is held.
    Drag,
    /// The mouse's wheel.
    Wheel,
}

/// One row of the table.
#[derive(Clone, Debug)]
pub struct Binding {
    /// Alternative triggers.
    pub triggers: Vec<Trigger>,
    /// Description for the help overlay.
    pub about: String,
    /// Action.
    pub action: Action,
}

/// Returns the whole table. The digits choose the first nine techniques.
pub fn table(techniques: &Techniques) -> Vec<Binding> {
    use Action as A;
    use Trigger::{Character, Drag, Named, Position, Wheel};
    let row = |triggers: &[Trigger], about: &str, action| Binding {
        triggers: triggers.to_vec(),
        about: about.to_string(),
        action,
    };
    let moves = |place, arrow: Option<KeyCode>, about, direction| {
        let triggers: Vec<_> = [Some(place), arrow].into_iter().flatten().map(Position).collect();
        row(&triggers, about, A::Move(direction))
    };
    let mut rows = vec![
        moves(KeyCode::KeyW, Some(KeyCode::ArrowUp), "forward", DVec3::Z),
        moves(KeyCode::KeyS, Some(KeyCode::ArrowDown), "back", DVec3::NEG_Z),
        moves(KeyCode::KeyA, Some(KeyCode::ArrowLeft), "left", DVec3::NEG_X),
        moves(KeyCode::KeyD, Some(KeyCode::ArrowRight), "right", DVec3::X),
        moves(KeyCode::KeyE, None, "up", DVec3::Y),
        moves(KeyCode::KeyQ, None, "down", DVec3::NEG_Y),
        row(&[Position(KeyCode::ShiftLeft), Position(KeyCode::ShiftRight)], "move faster", A::Fast),
        row(&[Drag], "look around", A::Turn),
        row(&[Wheel], "speed; distance in orbit; width with --ortho", A::Speed),
        row(&[Named(NamedKey::Tab)], "camera: fly, orbit, walk", A::Camera),
        row(&[Named(NamedKey::Home)], "camera back to the start", A::Home),
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
        rows.push(row(&[Position(digit), Position(pad)], &format!("technique: {}", entry.name), A::Technique(k)));
    }
    rows.extend([
        row(&[Character("v")], "next variant of the technique", A::Variant),
        row(&[Character("+"), Character("=")], "tolerance up: coarser", A::Tolerance(std::f64::consts::SQRT_2)),
        row(&[Character("-")], "tolerance down: finer", A::Tolerance(std::f64::consts::FRAC_1_SQRT_2)),
        row(&[Character("f")], "wireframe", A::Wireframe),
        row(&[Character("l")], "level colours", A::LevelColours),
        row(&[Character("c")], "next colour mode", A::Colour),
        row(&[Character("z")], "freeze the selection", A::Freeze),
        row(&[Character("p"), Named(NamedKey::F12)], "screenshot", A::Screenshot),
        row(&[Character("u")], "statistics on or off", A::Hud),
        row(&[Character("h"), Named(NamedKey::F1)], "this help", A::Help),
        row(&[Named(NamedKey::Escape)], "quit", A::Quit),
    ]);
    rows
}

impl Trigger {
    fn is(&self, event: &KeyEvent) -> bool {
        match self {
            Trigger::Position(code) => event.physical_key == PhysicalKey::Code(*code),
            Trigger::Character(text) => matches!(&event.logical_key, Key::Character(c) if c.to_lowercase() == *text),
            Trigger::Named(name) => event.logical_key == Key::Named(*name),
            Trigger::Drag | Trigger::Wheel => false,
        }
    }
}

impl fmt::Display for Trigger {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Trigger::Position(code) => {
                let name = format!("{code:?}");
                let parts = ["Key", "Digit", "Arrow"];
                let name = parts.iter().find_map(|part| name.strip_prefix(part)).unwrap_or(&name);
                f.write_str(name)
            }
            Trigger::Character(text) => f.write_str(&text.to_uppercase()),
            Trigger::Named(NamedKey::Escape) => f.write_str("Esc"),
            Trigger::Named(name) => write!(f, "{name:?}"),
            Trigger::Drag => f.write_str("drag"),
            Trigger::Wheel => f.write_str("wheel"),
        }
    }
}

impl Binding {
    /// Returns the triggers as text for the help overlay.
    pub fn keys(&self) -> String {
        // Number-pad keys and the right Shift key duplicate others.
        let is_duplicate = |t: &&Trigger| {
            let name = format!("{t:?}");
            name.contains("Numpad") || name.contains("Right)") && name.contains("Shift")
        };
        let keys = self.triggers.iter().filter(|t| !is_duplicate(t)).map(Trigger::to_string);
        keys.map(|key| key.replace("ShiftLeft", "Shift")).collect::<Vec<_>>().join("  ")
    }
}

/// Returns the action of a key event.
pub fn action_of_key(table: &[Binding], event: &KeyEvent) -> Option<Action> {
    table.iter().find(|row| row.triggers.iter().any(|t| t.is(event))).map(|row| row.action)
}

/// Returns the action of a mouse trigger.
pub fn action_of(table: &[Binding], trigger: Trigger) -> Option<Action> {
    table.iter().find(|row| row.triggers.contains(&trigger)).map(|row| row.action)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triggers_are_unique_and_every_technique_has_a_key() {
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
