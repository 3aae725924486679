//! The scene file: what each table of `scene.toml` may hold, with units and defaults.
//!
//! Lengths are metres, angles degrees, colours linear Rec. 709. Paths of other files are relative to the scene
//! file. Every structure refuses keys that it does not know. One-of-many choices are keys of their own
//! (`[[shape]]` with `sphere = {…}`, `[material.red]` with `diffuse = {…}`), so that an error always points at
//! the right line.

mod appearance;
mod media;

pub use appearance::*;
pub use media::*;

use super::choice::choice;
use super::values::*;
use serde::Deserialize;
use toml::Spanned;

/// A whole scene file.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// What the scene is called; default: the name of its folder.
    pub name: Option<String>,
    /// A sentence or two about the scene, for `tyndall info`.
    pub description: Option<String>,
    /// The image: `[film]`.
    #[serde(default)]
    pub film: FilmDef,
    /// Where the scene is seen from: `[camera]`.
    pub camera: Option<Spanned<CameraDef>>,
    /// What is about all shapes: `[world]`.
    #[serde(default)]
    pub world: WorldDef,
    /// What a render of this scene does unless told otherwise: `[render]`.
    #[serde(default)]
    pub render: RenderDef,
    /// Textures by name: `[texture.NAME]`.
    #[serde(default)]
    pub texture: Named<TextureDef>,
    /// Materials by name: `[material.NAME]`.
    #[serde(default)]
    pub material: Named<MaterialDef>,
    /// Media by name: `[medium.NAME]`.
    #[serde(default)]
    pub medium: Named<MediumDef>,
    /// Shapes, in order: `[[shape]]`.
    #[serde(default)]
    pub shape: Vec<Spanned<ShapeDef>>,
    /// Lights that are not shapes, in order: `[[light]]`.
    #[serde(default)]
    pub light: Vec<Spanned<LightDef>>,
}

/// `[film]`: the image.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct FilmDef {
    /// Width in pixels; default 512.
    pub width: Count<1>,
    /// Height in pixels; default 512.
    pub height: Count<1>,
    /// The part to render: `[x0, y0, x1, y1]` in pixels from the top left, x1 and y1 not included; default: all.
    pub crop: Option<Spanned<[Count<0>; 4]>>,
}

impl Default for FilmDef {
    fn default() -> Self {
        Self { width: Count(512), height: Count(512), crop: None }
    }
}

/// `[camera]`: a perspective camera, a pinhole or with a thin lens.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct CameraDef {
    /// The centre of projection.
    pub origin: Triple,
    /// A point that is seen in the middle of the image.
    pub target: Triple,
    /// A direction that is up in the image; default `[0, 1, 0]`.
    pub up: Option<Triple>,
    /// Full angle of view along `fov_axis`, in degrees, above 0 and below 180; default 45.
    pub fov: Option<Spanned<Positive>>,
    /// Which side of the image `fov` spans; default `horizontal`.
    #[serde(default)]
    pub fov_axis: FovAxis,
    /// Radius of the lens; default 0: a pinhole.
    pub lens_radius: Option<NonNegative>,
    /// Distance from the lens to the plane in focus, along the view direction; default: that of the target.
    pub focus_distance: Option<Positive>,
    /// Distance of the plane where rays begin, along the view direction: surfaces and media before it are not there for the
    /// camera, only for light. Default 0: rays begin at the lens.
    pub near: Option<NonNegative>,
}

/// Which side of the image a field of view spans.
#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum FovAxis {
    /// From left to right.
    #[default]
    Horizontal,
    /// From top to bottom.
    Vertical,
}

/// `[world]`: what is about all shapes, and about the camera where it is in none.
#[derive(Deserialize, Debug, Default)]
#[serde(deny_unknown_fields)]
pub struct WorldDef {
    /// Name of the medium that fills all space outside of solids, without end; default: none. Light from infinitely far
    /// away does not get through it.
    pub medium: Option<Spanned<String>>,
}

/// `[render]`: defaults for renders of this scene; the command line and experiments override them.
#[derive(Deserialize, Debug, Default)]
#[serde(deny_unknown_fields)]
pub struct RenderDef {
    /// Longest paths, in segments from light to lens.
    pub max_length: Option<Spanned<Count<1>>>,
    /// Shortest paths, in segments from light to lens.
    pub min_length: Option<Spanned<Count<1>>>,
}

/// `[[shape]]`: exactly one of the kinds, what it is made of, whether it shines, and where it stands.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct ShapeDef {
    /// For `tyndall info` and errors; default: its kind and number.
    pub name: Option<String>,
    /// Name of its material, see `[material.NAME]`. A shape that emits may go without: it reflects nothing.
    pub material: Option<Spanned<String>>,
    /// Radiance that it emits.
    pub emission: Option<EmissionDef>,
    /// Name of the medium inside, see `[medium.NAME]`; default: nothing. For closed shapes of any material: a room may
    /// be full of fog.
    pub interior: Option<Spanned<String>>,
    /// Where solids overlap, the one with the higher priority is there; default 0. Among equals it is the smaller one,
    /// so what lies wholly inside another needs none.
    pub priority: Option<Spanned<i32>>,
    /// Steps from the shape's own coordinates to the world's, the first step applied first; default: none.
    #[serde(default)]
    pub transform: Vec<Spanned<StepDef>>,
    /// A sphere; its outside is out.
    pub sphere: Option<Spanned<SphereDef>>,
    /// A parallelogram.
    pub rectangle: Option<Spanned<RectangleDef>>,
    /// A disc.
    pub disc: Option<Spanned<DiscDef>>,
    /// A box with its sides along the axes; its outside is out.
    #[serde(rename = "box")]
    pub cuboid: Option<Spanned<BoxDef>>,
    /// Triangles from a file.
    pub mesh: Option<Spanned<MeshDef>>,
    /// A profile turned about the y axis.
    pub lathe: Option<Spanned<LatheDef>>,
}

/// `sphere = { center, radius }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct SphereDef {
    /// Default: the origin.
    pub center: Option<Triple>,
    /// Its radius.
    pub radius: Positive,
}

/// `rectangle = { corner, u, v }`: the points corner + a·u + b·v for a and b from 0 to 1. Its normal is u × v;
/// texture coordinates are (a, b).
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct RectangleDef {
    /// The corner at (0, 0).
    pub corner: Triple,
    /// From the corner along one side.
    pub u: Triple,
    /// From the corner along the other side.
    pub v: Triple,
}

/// `disc = { center, normal, radius }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct DiscDef {
    /// Default: the origin.
    pub center: Option<Triple>,
    /// The direction that its front faces, of any length; default `[0, 1, 0]`.
    pub normal: Option<Triple>,
    /// Its radius.
    pub radius: Positive,
}

/// `box = { min, max }`: two opposite corners. Every side has texture coordinates from 0 to 1.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct BoxDef {
    /// The corner with the smallest coordinates.
    pub min: Triple,
    /// The corner with the largest coordinates.
    pub max: Triple,
}

/// `mesh = { file, smooth }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct MeshDef {
    /// An OBJ or PLY file.
    pub file: Spanned<String>,
    /// Whether it is shaded smooth: with the file's normals or, where it has none, with normals averaged at each
    /// vertex. Default: smooth if the file has normals.
    pub smooth: Option<bool>,
}

/// `lathe = { profile, segments, smooth, crease }`: the profile turned once about the y axis. Texture coordinates:
/// u around, v along the profile.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct LatheDef {
    /// Points `[radius, height]` and curves from the point before. Outside is to the right of the way along the
    /// profile, seen with the radius to the right and the height up: a profile from the bottom to the top has it
    /// away from the axis. A solid starts and ends on the axis (radius 0), or ends where it starts. A point that
    /// is given twice stays a sharp corner.
    pub profile: Spanned<Vec<Spanned<ProfilePiece>>>,
    /// Flat steps about the axis, at least 3; default 64.
    pub segments: Option<Count<3>>,
    /// Whether it is shaded smooth; default true.
    pub smooth: Option<bool>,
    /// With smooth shading: corners of the profile that turn by more than this, in degrees, stay sharp; default 40.
    pub crease: Option<NonNegative>,
}

/// A piece of a lathe's profile.
#[derive(Debug)]
pub enum ProfilePiece {
    /// A corner: `[radius, height]`.
    Point(Pair),
    /// `{ bezier = [c1, c2, end], steps = 16 }` or `{ through = [p, …], steps = 8 }`.
    Curve(CurveDef),
}

/// A curve of a profile; exactly one of `bezier` and `through`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct CurveDef {
    /// A cubic from the point before: two control points and the end.
    pub bezier: Option<[Pair; 3]>,
    /// A smooth curve from the point before through each of these (Catmull-Rom).
    pub through: Option<Vec<Pair>>,
    /// Straight pieces for a cubic, or for each span of a curve through points; default 12.
    pub steps: Option<Count<1>>,
}

choice! {
    /// One step of a transform.
    pub enum StepDef {
        /// `{ translate = [x, y, z] }`.
        "translate" => Translate(Triple),
        /// `{ rotate = { axis = [x, y, z], angle = 30 } }`, counter-clockwise looking against the axis.
        "rotate" => Rotate(RotateDef),
        /// `{ scale = 2 }` or `{ scale = [x, y, z] }`.
        "scale" => Scale(Color<AnyNumber>),
        /// `{ matrix = [[…], […], […]] }`: rows of a 3×4 matrix, or of a 4×4 one with the last row 0 0 0 1.
        "matrix" => Matrix(Vec<Row>),
        /// `{ look_at = { origin, target, up } }`: the origin goes to `origin`, the z axis points to `target`.
        "look_at" => LookAt(LookAtDef),
    }
}

/// `rotate = { axis, angle }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct RotateDef {
    /// Of any length.
    pub axis: Triple,
    /// In degrees.
    pub angle: Number,
}

/// `look_at = { origin, target, up }`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct LookAtDef {
    /// Where the origin goes.
    pub origin: Triple,
    /// What the z axis then points to.
    pub target: Triple,
    /// Close to where the y axis then points; default `[0, 1, 0]`.
    pub up: Option<Triple>,
}

/// A table of things by name, in the order of the file.
#[derive(Debug)]
pub struct Named<T>(pub Vec<(Spanned<String>, Spanned<T>)>);

impl<T> Default for Named<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Named<T> {
    /// The names, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(name, _)| name.get_ref().as_str())
    }
}
