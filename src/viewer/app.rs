//! The window's event handling and frame loop.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use glam::{DVec2, DVec3};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, KeyEvent, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::{Window, WindowId};

use super::bindings::{self, Action, Binding, Trigger};
use super::camera::Motion;
use super::hud::{self, Content};
use super::renderer::{FrameRequest, FrameStats, Shown, WindowRenderer};
use super::session::{Request, Session, free_path};
use super::setup::{Setup, Summary};
use super::times::Times;
use crate::gpu::instance::Messages;
use crate::gpu::{Instance, swapchain};
use crate::lod::{Entry, Settings};
use crate::view::{Lens, View};

/// Sleep per loop iteration while the window is not visible.
const IDLE_SLEEP: Duration = Duration::from_millis(20);

/// User event that ends the event loop.
#[derive(Clone, Copy, Debug)]
pub struct QuitEvent;

/// State of the program while its window is open.
pub struct App<'a> {
    setup: &'a Setup,
    bindings: Vec<Binding>,
    session: Session,
    open: Option<OpenWindow>,
    input: Input,
    times: Times,
    started: Instant,
    last_frame: Option<Instant>,
    device: String,
    messages: Messages,
    failure: Option<anyhow::Error>,
}

/// The window and its renderer. Fields drop in order: the renderer before the window.
struct OpenWindow {
    renderer: WindowRenderer,
    context: egui::Context,
    window: Arc<Window>,
    is_occluded: bool,
}

/// Keys held down, and mouse input since the last frame.
#[derive(Default)]
struct Input {
    held: Vec<Action>,
    is_dragging: bool,
    pointer: Option<DVec2>,
    dragged_px: DVec2,
    wheel: f64,
}

impl<'a> App<'a> {
    /// Creates the state; the window opens when the event loop resumes.
    pub fn new(setup: &'a Setup) -> Self {
        Self {
            setup,
            bindings: bindings::table(&setup.techniques),
            session: Session::new(setup),
            open: None,
            input: Input::default(),
            times: Times::default(),
            started: Instant::now(),
            last_frame: None,
            device: String::new(),
            messages: Messages::default(),
            failure: None,
        }
    }

    /// Returns the statistics of the session after the loop has ended, or its error.
    pub fn into_summary(mut self) -> Result<Summary> {
        let seconds = self.started.elapsed().as_secs_f64();
        // Dropping device and instance may add validation messages.
        self.open = None;
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        let messages = self.messages.lock().unwrap_or_else(|e| e.into_inner()).clone();
        let (frames, frame_ms) = (self.times.count(), self.times.percentiles());
        Ok(Summary { device: self.device, frames, seconds, frame_ms, messages })
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let [width, height] = self.setup.view.size;
        let attributes = Window::default_attributes()
            .with_title(self.session.title(self.setup))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = Arc::new(event_loop.create_window(attributes).context("no window could be created")?);
        let instance = Instance::new(&swapchain::extensions(event_loop)?, self.setup.validate)?;
        self.messages = Arc::clone(&instance.messages);
        let shared: Arc<dyn swapchain::Window> = Arc::clone(&window) as _;
        let renderer = WindowRenderer::new(self.setup, &instance, shared)?;
        self.device = renderer.device().to_string();
        self.open = Some(OpenWindow { renderer, context: egui::Context::default(), window, is_occluded: false });
        self.started = Instant::now();
        Ok(())
    }

    /// Moves the camera and draws a frame.
    fn frame(&mut self) -> Result<()> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let size = open.window.inner_size();
        let fit = if open.is_occluded { None } else { open.renderer.fit([size.width, size.height])? };
        let Some(size) = fit else {
            self.last_frame = None;
            std::thread::sleep(IDLE_SLEEP);
            return Ok(());
        };
        let now = Instant::now();
        let dt = self.last_frame.replace(now).map(|last| (now - last).as_secs_f64());
        let motion = self.input.motion(degrees_per_width(self.setup.view.lens) / f64::from(size[0]));
        self.session.advance(&motion, &open.renderer.stats, dt.unwrap_or(0.0));
        let time_s = self.started.elapsed().as_secs_f64();
        let view = View { time_s, ..self.session.view(self.setup, size) };
        let Session { look, frozen, wants_copy, .. } = self.session;
        let scale = open.window.scale_factor() as f32;
        let overlay = |stats: &FrameStats| {
            let content = Content {
                rows: self.session.rows(stats),
                help: self.session.shows_help.then_some(self.bindings.as_slice()),
                // Screenshots do not show the note about the previous one.
                note: self.session.note().filter(|_| !wants_copy),
            };
            hud::paint(&open.context, size, scale, &content)
        };
        let look = look.after(time_s);
        let request = FrameRequest { view: &view, look: &look, frozen, wants_copy };
        if let Some(shown) = open.renderer.show(self.setup, &request, overlay)? {
            if let Some(dt) = dt {
                self.times.add(dt * 1e3);
            }
            self.save_screenshot(shown);
        }
        Ok(())
    }

    /// Saves the copy of a frame if one was requested.
    fn save_screenshot(&mut self, shown: Shown) {
        if !std::mem::take(&mut self.session.wants_copy) {
            return;
        }
        let path = free_path();
        let note = match shown.copy.map(|picture| (self.setup.save)(&path, &picture)) {
            Some(Ok(())) => format!("saved {}", path.display()),
            Some(Err(error)) => format!("screenshot not saved: {error:#}"),
            None => "screenshots of this window are not supported".to_string(),
        };
        self.session.show_note(note);
        self.last_frame = None;
    }

    fn perform(&mut self, event_loop: &ActiveEventLoop, action: Action) -> Result<()> {
        let before = self.session.technique.clone();
        let request = self.session.perform(self.setup, action);
        let Some(open) = &mut self.open else { return Ok(()) };
        match request {
            Request::Nothing => return Ok(()),
            Request::Quit => event_loop.exit(),
            Request::Look => open.renderer.set_look(self.setup, &self.session.look)?,
            Request::Technique => self.prepare(before)?,
        }
        // Preparation time is not frame time.
        self.last_frame = None;
        Ok(())
    }

    /// Prepares the session's technique. Restores the previous one if the device cannot hold it.
    fn prepare(&mut self, before: (&'static Entry, Settings)) -> Result<()> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let (entry, settings) = &self.session.technique;
        open.window.set_title(&format!("cuesta: preparing {}", entry.name));
        if let Err(error) = open.renderer.set_technique(self.setup, &self.session.look, entry, settings) {
            self.session.show_note(format!("{}: {error:#}", entry.name));
            open.renderer.set_technique(self.setup, &self.session.look, before.0, &before.1)?;
            self.session.technique = before;
        }
        open.window.set_title(&self.session.title(self.setup));
        Ok(())
    }

    fn key(&mut self, event_loop: &ActiveEventLoop, event: &KeyEvent) -> Result<()> {
        let Some(action) = bindings::action_of_key(&self.bindings, event) else { return Ok(()) };
        self.input.held.retain(|held| *held != action);
        if event.state == ElementState::Released {
            return Ok(());
        }
        match action {
            Action::Move(_) | Action::Fast => self.input.held.push(action),
            Action::Tolerance(_) => return self.perform(event_loop, action),
            _ if !event.repeat => return self.perform(event_loop, action),
            _ => {}
        }
        Ok(())
    }

    fn handle(&mut self, event_loop: &ActiveEventLoop, event: WindowEvent) -> Result<()> {
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::RedrawRequested => return self.frame(),
            WindowEvent::KeyboardInput { event, is_synthetic: false, .. } => return self.key(event_loop, &event),
            WindowEvent::Focused(false) => self.input = Input::default(),
            WindowEvent::Occluded(is_occluded) => {
                if let Some(open) = &mut self.open {
                    open.is_occluded = is_occluded;
                }
            }
            WindowEvent::MouseInput { state, .. } => {
                let looks = bindings::action_of(&self.bindings, Trigger::Drag) == Some(Action::Turn);
                self.input.is_dragging = looks && state == ElementState::Pressed;
            }
            WindowEvent::CursorMoved { position, .. } => self.input.point(DVec2::new(position.x, position.y)),
            WindowEvent::MouseWheel { delta, .. } if bindings::action_of(&self.bindings, Trigger::Wheel).is_some() => {
                self.input.wheel += match delta {
                    MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y / 40.0,
                };
            }
            _ => {}
        }
        Ok(())
    }

    /// Ends the loop if something failed.
    fn check(&mut self, event_loop: &ActiveEventLoop, result: Result<()>) {
        if let Err(error) = result {
            self.failure.get_or_insert(error);
            event_loop.exit();
        }
    }
}

impl Input {
    fn point(&mut self, at: DVec2) {
        let moved = at - self.pointer.unwrap_or(at);
        self.pointer = Some(at);
        if self.is_dragging {
            self.dragged_px += moved;
        }
    }

    /// Returns the camera motion of this frame and resets accumulated mouse input.
    fn motion(&mut self, degrees_per_px: f64) -> Motion {
        let drive: DVec3 = self.held.iter().map(|a| if let Action::Move(axis) = a { *axis } else { DVec3::ZERO }).sum();
        Motion {
            drive: drive.clamp(DVec3::NEG_ONE, DVec3::ONE),
            fast: self.held.contains(&Action::Fast),
            turn: std::mem::take(&mut self.dragged_px) * degrees_per_px,
            wheel: std::mem::take(&mut self.wheel),
        }
    }
}

/// Returns the camera turn for a drag across the whole window, degrees.
fn degrees_per_width(lens: Lens) -> f64 {
    match lens {
        Lens::Perspective { fov_x } => fov_x.to_degrees(),
        Lens::Orthographic { .. } => 90.0,
    }
}

impl ApplicationHandler<QuitEvent> for App<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        // Each frame requests a redraw; the window system schedules it.
        event_loop.set_control_flow(ControlFlow::Wait);
        if self.open.is_none() {
            let opened = self.open(event_loop);
            self.check(event_loop, opened);
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let handled = self.handle(event_loop, event);
        self.check(event_loop, handled);
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, _: QuitEvent) {
        event_loop.exit();
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(seconds) = self.setup.seconds {
            let left = seconds - self.started.elapsed().as_secs_f64();
            if left <= 0.0 {
                event_loop.exit();
            }
            let left = Duration::try_from_secs_f64(left.min(1.0)).unwrap_or_default();
            event_loop.set_control_flow(ControlFlow::wait_duration(left));
        }
        if let Some(open) = &self.open {
            open.window.request_redraw();
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // Must happen before the window system shuts down.
        self.open = None;
    }
}
