//! How the viewer lays a recording out. The SDK's own builder cannot set a view's eye, grid or legend, so the blueprint
//! is logged piece by piece.

use super::look;
use super::names::{APPLICATION, FOLLOWED, TIMELINE};
use crate::recording::content::Recording;
use nalgebra::{Rotation3, Vector3};
use rerun::datatypes::Uuid;
use rerun::external::re_log_types::{BlueprintActivationCommand, LogMsg, RecordingId};
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend,
    ScalarAxis, TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint,
};
use rerun::external::re_sdk_types::blueprint::components::{
    BackgroundKind, ContainerKind, Corner2D, Fps, IncludedContent, LoopMode, PanelState, PlayState,
    RootContainer, TimelineName, ViewClass,
};
use rerun::{AsComponents, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};

/// The eye follows a character that travels farther than this, metres. Chosen: a whole kick or jump stays in view below.
const FOLLOW_BEYOND: f64 = 3.0;

/// Sends the layout before the data, and makes it the layout that the viewer opens with.
pub fn send(stream: &RecordingStream, shown: &Recording) -> RecordingStreamResult<()> {
    let (layout, storage) = RecordingStreamBuilder::new(APPLICATION)
        .recording_id(RecordingId::random())
        .blueprint()
        .memory()?;
    layout.set_time_sequence("blueprint", 0);
    log(&Layout(&layout), shown)?;
    let messages = storage.take();
    let blueprint_id = messages.iter().find_map(|message| match message {
        LogMsg::SetStoreInfo(info) => Some(info.info.store_id.clone()),
        _ => None,
    });
    if let Some(blueprint_id) = blueprint_id {
        let activation = BlueprintActivationCommand {
            blueprint_id,
            make_active: true,
            make_default: true,
        };
        stream.send_blueprint(messages, activation);
    }
    Ok(())
}

/// The scene on the left, the plots on the right.
fn log(layout: &Layout, shown: &Recording) -> RecordingStreamResult<()> {
    let scene = scene(layout, shown)?;
    let (views, shares): (Vec<_>, Vec<_>) = plots(layout, shown)?.into_iter().unzip();
    let side = layout.container(100, ContainerKind::Vertical, &views, |c| {
        c.with_row_shares(shares)
    })?;
    let root = [scene, side];
    layout.container(101, ContainerKind::Horizontal, &root, |c| {
        c.with_col_shares([2.6_f32, 1.0])
    })?;
    layout.viewport(101)?;
    layout.panels(shown.fps)
}

/// The views of the plots, each with its share of the height.
fn plots(layout: &Layout, shown: &Recording) -> RecordingStreamResult<Vec<(String, f32)>> {
    let mut plots = Vec::new();
    let unit = Some([0.0, 1.0]);
    if !shown.rewards.is_empty() {
        let legend = Corner2D::LeftBottom;
        let view = plot(layout, 2, "reward terms", "plots/rewards", unit, legend)?;
        plots.push((view, 3.6));
    }
    // A lane for every body of every character, and the heading.
    let lanes = 0.6 + 0.45 * (shown.contacts().len() * shown.actors().count()) as f32;
    let contacts = layout.view(3, "StateTimeline", "ground contact", "plots/contacts")?;
    plots.push((contacts, lanes));
    let height = "height of the centre of mass, m";
    let momentum = "angular momentum, kg·m²/s";
    for (number, name, origin, range, share) in [
        (4, height, "plots/com_height", None, 2.0),
        (5, momentum, "plots/angular_momentum", None, 2.0),
        (6, "phase", "plots/phase", unit, 1.2),
    ] {
        let view = plot(layout, number, name, origin, range, Corner2D::LeftTop)?;
        plots.push((view, share));
    }
    Ok(plots)
}

fn scene(layout: &Layout, shown: &Recording) -> RecordingStreamResult<String> {
    let view = layout.view(1, "3D", &shown.name, "world")?;
    let background =
        Background::new(BackgroundKind::SolidColor).with_color(look::color(look::BACKGROUND));
    layout.property(&view, "Background", &background)?;
    let grid = LineGrid3D::new()
        .with_visible(true)
        .with_spacing(0.5)
        .with_stroke_width(1.0);
    layout.property(
        &view,
        "LineGrid3D",
        &grid.with_color(look::color(look::GRID)),
    )?;
    layout.property(&view, "EyeControls3D", &eye(shown))?;
    Ok(view)
}

/// The eye looks from the front left. It is far enough away to see the whole motion, or follows a character that travels.
fn eye(shown: &Recording) -> EyeControls3D {
    let lead = shown.actors().next().map(|(_, actor)| actor);
    let com = lead.map_or(&[][..], |actor| &actor.com);
    let start = com.first().copied().unwrap_or(Vector3::z());
    let (low, high) = com
        .iter()
        .fold((start, start), |(low, high), p| (low.inf(p), high.sup(p)));
    let follows = (high - low).xy().norm() > FOLLOW_BEYOND;
    let aside = Vector3::new(0.0, -shown.beside / 2.0, 0.0);
    let middle = aside + if follows { start } else { (low + high) / 2.0 };
    let width = if follows {
        0.0
    } else {
        (high - low).xy().norm()
    };
    let distance = 2.1 + 0.9 * width + 0.8 * shown.beside;
    let direction = Rotation3::from_euler_angles(0.0, -0.26, 0.85) * Vector3::x();
    let target = Vector3::new(middle.x, middle.y, middle.z.max(0.6) - 0.1);
    let place = target + direction * distance;
    let eye = EyeControls3D::new()
        .with_position(place.map(|c| c as f32).data.0[0])
        .with_look_target(target.map(|c| c as f32).data.0[0])
        .with_eye_up([0.0, 0.0, 1.0]);
    if follows {
        let branch = if shown.agent.is_some() {
            "agent"
        } else {
            "reference"
        };
        return eye.with_tracking_entity(format!("/world/{branch}/{FOLLOWED}"));
    }
    eye
}

fn plot(
    layout: &Layout,
    number: u8,
    name: &str,
    origin: &str,
    range: Option<[f64; 2]>,
    legend: Corner2D,
) -> RecordingStreamResult<String> {
    let view = layout.view(number, "TimeSeries", name, origin)?;
    let legend = PlotLegend::new().with_corner(legend);
    layout.property(&view, "PlotLegend", &legend)?;
    if let Some([low, high]) = range {
        let room = 0.05 * (high - low);
        let axis = ScalarAxis::new().with_range([low - room, high + room]);
        layout.property(&view, "ScalarAxis", &axis)?;
    }
    Ok(view)
}

/// The stream that the layout is logged to.
struct Layout<'a>(&'a RecordingStream);

impl Layout<'_> {
    /// Logs a view of everything below `origin`, and returns its path.
    fn view(
        &self,
        number: u8,
        class: &str,
        name: &str,
        origin: &str,
    ) -> RecordingStreamResult<String> {
        let path = format!("view/{}", hyphenated(number));
        let blueprint = ViewBlueprint::new(ViewClass(class.into()))
            .with_display_name(name)
            .with_space_origin(format!("/{origin}"));
        self.0.log(path.as_str(), &blueprint)?;
        self.0.log(
            format!("{path}/ViewContents"),
            &ViewContents::new(["$origin/**"]),
        )?;
        Ok(path)
    }

    fn property(
        &self,
        view: &str,
        name: &str,
        property: &impl AsComponents,
    ) -> RecordingStreamResult<()> {
        self.0.log(format!("{view}/{name}"), property)
    }

    fn container(
        &self,
        number: u8,
        kind: ContainerKind,
        contents: &[String],
        share: impl FnOnce(ContainerBlueprint) -> ContainerBlueprint,
    ) -> RecordingStreamResult<String> {
        let path = format!("container/{}", hyphenated(number));
        let contents = contents
            .iter()
            .map(|path| IncludedContent(path.as_str().into()));
        let blueprint = share(ContainerBlueprint::new(kind).with_contents(contents));
        self.0.log(path.as_str(), &blueprint)?;
        Ok(path)
    }

    fn viewport(&self, root: u8) -> RecordingStreamResult<()> {
        let viewport = ViewportBlueprint::new()
            .with_root_container(RootContainer(uuid(root)))
            .with_auto_layout(false)
            .with_auto_views(false);
        self.0.log("viewport", &viewport)
    }

    fn panels(&self, fps: f64) -> RecordingStreamResult<()> {
        let collapsed = PanelBlueprint::new().with_state(PanelState::Collapsed);
        self.0.log("blueprint_panel", &collapsed)?;
        self.0.log("selection_panel", &collapsed)?;
        let time = TimePanelBlueprint::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(TimelineName(TIMELINE.into()))
            .with_fps(Fps(fps.into()))
            .with_play_state(PlayState::Playing)
            .with_loop_mode(LoopMode::All);
        self.0.log("time_panel", &time)
    }
}

fn uuid(number: u8) -> Uuid {
    let mut bytes = [0; 16];
    bytes[15] = number;
    Uuid { bytes }
}

/// The same identifier as the viewer writes it in a path.
fn hyphenated(number: u8) -> String {
    format!("00000000-0000-0000-0000-{number:012x}")
}
