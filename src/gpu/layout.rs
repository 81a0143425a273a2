//! Every struct that Rust and a shader share. `tests/shaders.rs` parses the shaders and compares names, offsets and sizes.

use bytemuck::{Pod, Zeroable};

/// Numbers that shaders and Rust both reckon with, by the name in braces that they stand for in a shader's text.
pub const SHARED_NUMBERS: &[(&str, u32)] = &[
    ("LIT", Frame::LIT),
    ("NORMALS", Frame::NORMALS),
    ("LEVELS", Frame::LEVELS),
    ("SKY", Frame::SKY),
    ("TILE_PX", TILE_PX),
    ("PLACE_BITS", PLACE_BITS),
    ("FACING_BITS", FACING_BITS),
    ("GROWN", GROWN),
    ("LENGTH_BITS", LENGTH_BITS),
    ("ROOTS_PER_GROUP", ROOTS_PER_GROUP),
    ("BEARINGS", BEARINGS),
    ("CAPTURE_SAMPLES", CAPTURE_SAMPLES),
    ("FACING", Presence::FACING),
    ("FACING_LEVEL", Presence::FACING_LEVEL),
    ("FACING_BOTH", Presence::FACING_BOTH),
    ("FACING_OWN", Presence::FACING_OWN),
    ("FACING_SECTOR", Presence::FACING_SECTOR),
    ("CULL_BLOCK", CullBlock::CANDIDATES),
    ("CULL_STRIPS", CullList::STRIPS),
    ("CULL_IN_PICTURE", CullSpan::IN_PICTURE),
    ("CULL_LEVEL", CullSpan::LEVEL),
    ("FADE_NEVER", Presence::FADE_NEVER),
    ("FADE_ALPHA", Presence::FADE_ALPHA),
    ("TURNED_UPRIGHT", Presence::TURNED_UPRIGHT),
    ("TURNED_WHOLLY", Presence::TURNED_WHOLLY),
];

/// Side of a tile of the picture, pixels.
pub const TILE_PX: u32 = 16;
/// Bits of the id target that hold the place round the limb.
pub const PLACE_BITS: u32 = 14;
/// Bits above those, which hold how far a surface faces the viewer; above them is the slot of the crown.
pub const FACING_BITS: u32 = 6;
/// What the id target has where a pixel has grown, beside its coverage in sixteenths.
pub const GROWN: u32 = 0x100;
/// Bits for the longest growth in pixels: 255 of them. With an offset of one bit more each way it fits a word.
pub const LENGTH_BITS: u32 = 8;
/// Samples of a captured pixel along each axis, as the software rasteriser has them.
pub const CAPTURE_SAMPLES: u32 = 3;
/// Roots that a workgroup walks.
pub const ROOTS_PER_GROUP: u32 = 64;

/// Pieces of the ring on which the ridges on the horizon are drawn.
pub const BEARINGS: u32 = 64;

/// What every pass knows of the frame: WGSL `Frame`, at group 0, binding 0.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Frame {
    /// World to clip space; depth is reversed: 1 at the near plane, 0 at infinity.
    pub clip_from_world: [[f32; 4]; 4],
    /// Its inverse.
    pub world_from_clip: [[f32; 4]; 4],
    /// World to the sun's shadow map; depth reversed.
    pub sun_clip_from_world: [[f32; 4]; 4],
    /// Where the viewer stands, metres.
    pub eye: [f32; 3],
    /// Seconds, for the wind.
    pub time_s: f32,
    /// Towards the sun, unit length.
    pub toward_sun: [f32; 3],
    /// What surfaces show: [`Frame::BASE_COLOR`], [`Frame::LIT`], [`Frame::NORMALS`] or [`Frame::LEVELS`].
    pub shading: u32,
    /// Sunlight on a face turned to it, linear.
    pub sun_color: [f32; 3],
    /// Side of a texel of the sun's shadow map, metres; 0 where nothing casts shadows.
    pub shadow_texel_m: f32,
    /// Light from above, linear.
    pub sky_color: [f32; 3],
    /// Where the ground lies, metres.
    pub ground_m: f32,
    /// Light from below, linear.
    pub ground_color: [f32; 3],
    /// Which background: a [`Background`](crate::render::Background) number.
    pub background: u32,
    /// Picture size, pixels.
    pub size_px: [f32; 2],
    /// Pixels per metre at depth d are `x + y · d`.
    pub px_per_m: [f32; 2],
    /// How far the wind pushes the top of a tree, share of its height, along world x and z.
    pub lean: [f32; 2],
    /// How far leaves flutter at most, metres.
    pub flutter_m: f32,
    /// Metres from depth 1 to depth 0 of the sun's shadow map.
    pub sun_depth_m: f32,
    /// Away from what is seen, unit length.
    pub backward: [f32; 3],
    /// Parallel projection: what is deeper by so much is another layer to the smoothing of outlines. In perspective 0.
    pub layer: f32,
    /// A thing `d` metres away looks as large as one `x + y · d` metres away in the picture for which distances are told
    /// ([`REFERENCE_FOCAL_PX`](crate::repr::REFERENCE_FOCAL_PX)).
    pub heights: [f32; 2],
    /// The air: metres over which it takes two thirds of what it ever takes of what is behind it, and the share that this is at most.
    pub haze: [f32; 2],
    /// From where distances are told by which levels of detail are chosen, metres.
    pub level_eye: [f32; 3],
    /// The sun chooses levels as for trees so many metres away in that picture; 0: as the viewer does.
    pub sun_level_m: f32,
}

impl Frame {
    /// The colours of the textures.
    pub const BASE_COLOR: u32 = 0;
    /// In the light of sun and sky.
    pub const LIT: u32 = 1;
    /// Which way they face: red right, green up, blue towards +Z.
    pub const NORMALS: u32 = 2;
    /// Their colours mixed with a hue for the distance from which on they are seen.
    pub const LEVELS: u32 = 3;
    /// The [`Background`](crate::render::Background) with air to see through.
    pub const SKY: u32 = 0;
}

/// What one part's surface is made of: WGSL `Material`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// Base colour factor, linear.
    pub factor: [f32; 4],
    /// Centre of the crown, object space.
    pub crown_center: [f32; 3],
    /// Less alpha is not there; 0 for opaque surfaces.
    pub alpha_cutoff: f32,
    /// Number of the crown within its tree, from 1, for a sphere-board crown, whose outline grows; 0 for everything else.
    pub grows: u32,
    /// Unused: keeps what follows at a multiple of 8.
    pub pad: u32,
    /// Half the crown's width and half its height, metres; 1 where there is no crown.
    pub crown_reach: [f32; 2],
    /// Height of the whole tree, metres, for the wind.
    pub tree_height_m: f32,
    /// At what height the tree stands, metres, object space: 0 but in files that centre theirs.
    pub tree_foot_m: f32,
    /// Unused: keeps what follows at a multiple of 16.
    pub pad2: [f32; 2],
    /// Middle of the tree's box, object space.
    pub tree_center: [f32; 3],
    /// Unused: keeps what follows at a multiple of 16.
    pub pad3: f32,
    /// Half the size of that box, metres.
    pub tree_half: [f32; 3],
    /// Unused: keeps the size a multiple of 16.
    pub pad4: f32,
}

/// When a part is seen and how its vertices are placed, a [`Seen`](crate::repr::Seen) and a [`Drawn`](crate::repr::Drawn): WGSL `Presence`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Presence {
    /// From where distances and sides are told, object space.
    pub anchor: [f32; 3],
    /// Octahedral: frames along each side of the atlas.
    pub grid: u32,
    /// Heights of the tree between which it appears.
    pub appears: [f32; 2],
    /// Between which it vanishes.
    pub vanishes: [f32; 2],
    /// Unit vector of the side from which it is seen.
    pub axis: [f32; 3],
    /// Octahedral: half the side of each picture, metres.
    pub radius_m: f32,
    /// What it turns about; octahedral: the middle of what was captured.
    pub pivot: [f32; 3],
    /// Unused: keeps what follows at a multiple of 16.
    pub pad: f32,
    /// From where it is told how far it is until it vanishes, object space.
    pub vanish_anchor: [f32; 3],
    /// Unused: keeps what follows at a multiple of 8.
    pub pad2: f32,
    /// Where it begins to be seen by the cosine to that side, and where it is seen wholly.
    pub cosines: [f32; 2],
    /// In a sector: sines of the viewer's elevation between which it comes to be seen.
    pub rises: [f32; 2],
    /// And between which it ceases to be.
    pub sinks: [f32; 2],
    /// Unused: keeps the size a multiple of 16.
    pub pad3: [f32; 2],
}

impl Presence {
    /// Always seen, from everywhere.
    pub const FADE_NEVER: u32 = 0;
    /// Thinned out pixel by pixel.
    pub const FADE_HASHED: u32 = 1;
    /// Thinned out by alpha.
    pub const FADE_ALPHA: u32 = 2;
    /// It is seen from one side.
    pub const FACING: u32 = 1;
    /// By azimuth alone.
    pub const FACING_LEVEL: u32 = 2;
    /// And from the other side.
    pub const FACING_BOTH: u32 = 4;
    /// By each polygon's own normal.
    pub const FACING_OWN: u32 = 8;
    /// And by elevation.
    pub const FACING_SECTOR: u32 = 16;
    /// A card that turns about the vertical.
    pub const TURNED_UPRIGHT: u32 = 1;
    /// A card that faces whoever sees it.
    pub const TURNED_WHOLLY: u32 = 2;
}

/// Where a picture for a stand-in is taken from: WGSL `CaptureView`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct CaptureView {
    /// Object to clip space of the tile being drawn; depth reversed.
    pub clip_from_object: [[f32; 4]; 4],
    /// Of depth 0: metres towards the viewer from the middle of the view.
    pub far_m: f32,
    /// Metres from depth 0 to depth 1.
    pub deep_m: f32,
    /// Unused: keeps the size a multiple of 16.
    pub pad: [f32; 2],
}

/// What growth knows of the frame: WGSL `GrowthFrame`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct GrowthFrame {
    /// Picture size, pixels.
    pub size_px: [u32; 2],
    /// Pixels per metre at depth d are `x + y · d`.
    pub px_per_m: [f32; 2],
    /// Perspective: near plane · 2^24, metres; parallel: depth range, metres.
    pub depth_units: f32,
    /// 1 for a parallel projection.
    pub orthographic: u32,
    /// 1: the last, partly covered pixel of a growth is drawn with its coverage; 0: it is left out.
    pub tips: u32,
    /// 1: outlines before deeper trees grow too.
    pub inner: u32,
    /// 1: She's lengths, new for every pixel and frame.
    pub random: u32,
    /// Number of the frame, for those.
    pub frame: u32,
    /// 1: pixels with two background neighbours beside each other are roots too.
    pub corners: u32,
    /// How many tiles to look at.
    pub tile_count: u32,
    /// No crown takes for background what is nearer than its own depth · x − y: a quick test that spares the exact one.
    pub alike: [f32; 2],
}

/// How much a frame has grown so far: WGSL `Counts`. The first four are the arguments of the indirect draw of the grown pixels.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Counts {
    /// Grown pixels.
    pub grown: u32,
    /// 1.
    pub instances: u32,
    /// 0.
    pub first_vertex: u32,
    /// 0.
    pub first_instance: u32,
    /// Roots.
    pub roots: u32,
}

/// Where a grown pixel is: WGSL `GrownPlace`. What it shows is in a buffer of its own, since the smallest limit on a buffer is what
/// limits the picture.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct GrownPlace {
    /// Column | row << 16.
    pub pixel: u32,
    /// Of its root.
    pub depth: f32,
}

/// What a grown pixel shows: WGSL `GrownColor`, 16-bit floats.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct GrownColor {
    /// Of its root, linear.
    pub red_green: u32,
    /// The last of its colours, and how much of it is covered.
    pub blue_coverage: u32,
}

/// The pixels on outlines that get smooth in a frame: WGSL `Smoothed`. The first four are the arguments of their points' indirect draw.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Smoothed {
    /// How many there are.
    pub pixels: u32,
    /// 1.
    pub instances: u32,
    /// 0.
    pub first_vertex: u32,
    /// 0.
    pub first_instance: u32,
    /// In how many tiles they are looked for.
    pub tiles: u32,
}

/// One crown that is near enough to grow: WGSL `GrowingCrown`, in a storage buffer.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct GrowingCrown {
    /// First row from object space (from the crown's centre) to the plane of its limb, half axes made 1.
    pub limb_x: [f32; 3],
    /// Qmin, sixteenths of a pixel per 1/256 pixel per metre.
    pub min_units: f32,
    /// Second row.
    pub limb_y: [f32; 3],
    /// Qmax, as Qmin.
    pub max_units: f32,
    /// What lies this much deeper is background, metres.
    pub gap_m: f32,
    /// Where its part of the limb table begins.
    pub first: u32,
    /// How long that is.
    pub count: u32,
    /// Unused, keeps the size a multiple of 16.
    pub pad: u32,
}

/// What a corner of a leaf is on its way to be, beside the [`Vertex`] that it is.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Becoming {
    /// Where it will be: as a corner of the leaf that replaces it, or in the middle of its own, where that vanishes.
    pub position: [f32; 3],
    /// Its cluster.
    pub cluster: u32,
    /// Its normal then.
    pub normal: [f32; 3],
    /// 1 when the leaf that replaces it wears its picture: it grows into that one. 0 when it vanishes.
    pub heir: u32,
}

impl Becoming {
    /// Locations 6 to 9.
    pub const LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: size_of::<Self>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![6 => Float32x3, 7 => Uint32, 8 => Float32x3, 9 => Uint32],
    };
}

/// One vertex of a mesh.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Vertex {
    /// Object space, metres.
    pub position: [f32; 3],
    /// Unit normal, object space.
    pub normal: [f32; 3],
    /// Texture coordinates, glTF's.
    pub uv: [f32; 2],
}

/// One placed tree, 32 bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Instance {
    /// Foot, world space, metres.
    pub position: [f32; 3],
    /// Uniform scale.
    pub scale: f32,
    /// Turn as a unit quaternion x, y, z, w in signed 16-bit parts.
    pub rotation: [i16; 4],
    /// Number of the tree; only its low bits reach the id target.
    pub id: u32,
    /// Slot of its first crown among those that grow in this frame; 0 when none does.
    pub extra: u32,
}

/// One of many placed trees, 16 bytes: upright, so that a turn is an angle. WGSL `Placed`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Placed {
    /// Foot, world space, metres.
    pub position: [f32; 3],
    /// Two 16-bit floats: round the vertical in whole turns (±½), and uniform scale.
    pub turn_and_scale: u32,
}

impl Placed {
    /// A tree at a place, turned round the vertical.
    pub fn new(position: [f32; 3], yaw_rad: f32, scale: f32) -> Self {
        let turns = yaw_rad / std::f32::consts::TAU;
        let halves = [turns - turns.round(), scale].map(|value| u32::from(half::f16::from_f32(value).to_bits()));
        Self { position, turn_and_scale: halves[0] | halves[1] << 16 }
    }

    /// Round the vertical, radians.
    pub fn yaw_rad(&self) -> f32 {
        std::f32::consts::TAU * half::f16::from_bits(self.turn_and_scale as u16).to_f32()
    }

    /// Uniform scale.
    pub fn scale(&self) -> f32 {
        half::f16::from_bits((self.turn_and_scale >> 16) as u16).to_f32()
    }

    /// The same tree as one that is placed by itself.
    pub fn instance(&self, id: u32) -> Instance {
        let (sin, cos) = (0.5 * self.yaw_rad()).sin_cos();
        let part = |value: f32| (value * f32::from(i16::MAX)).round() as i16;
        Instance { position: self.position, scale: self.scale(), rotation: [0, part(sin), 0, part(cos)], id, extra: 0 }
    }

    /// Its number in a list of what is seen of many, one for each instance: location 3.
    pub const LIST: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: size_of::<u32>() as u64,
        step_mode: wgpu::VertexStepMode::Instance,
        attributes: &wgpu::vertex_attr_array![3 => Uint32],
    };
}

/// Who culls many trees on the device, and how closely: WGSL `CullLook`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct CullLook {
    /// What bounds the picture, positive inside.
    pub planes: [[f32; 4]; 6],
    /// Where the viewer stands.
    pub eye: [f32; 3],
    /// No tree counts as nearer.
    pub near_m: f32,
    /// A metre at distance d is `x + y / d` pixels.
    pub px_per_m: [f32; 2],
    /// The wind pushes a tree of height h at most `x · h + y`.
    pub sway: [f32; 2],
    /// Trees lower than that in the picture are left out.
    pub least_px: f32,
    /// 1: for the sun's map.
    pub for_sun: u32,
    /// Unused: keeps the size a multiple of 16.
    pub pad: [f32; 2],
}

/// When trees are in a list of what is seen, and how large their species is: WGSL `CullGroup`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct CullGroup {
    /// At which distances and from which sides.
    pub seen: Presence,
    /// Bits: [`Presence::FACING`] and so on.
    pub facing: u32,
    /// Height of the species, metres.
    pub height_m: f32,
    /// Radius of the ball around it.
    pub radius_m: f32,
    /// How high the middle of that lies.
    pub center_m: f32,
}

/// Neighbouring trees that may be in a list: WGSL `CullSpan`. After the last come two that begin at `u32::MAX`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct CullSpan {
    /// The number of its first candidate.
    pub at: u32,
    /// And which tree that is.
    pub tree: u32,
    /// How many they are, and what is to be asked of them.
    pub count_and_tests: u32,
}

impl CullSpan {
    /// Whether they are in the picture.
    pub const IN_PICTURE: u32 = 1 << 31;
    /// Whether they are seen at their distance and from their side.
    pub const LEVEL: u32 = 1 << 30;
}

/// Candidates that a workgroup asks: WGSL `CullBlock`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct CullBlock {
    /// Of which list.
    pub list: u32,
    /// The span of the first of them.
    pub first_span: u32,
    /// Bits of those that are kept: the first 32, the others.
    pub kept_low: u32,
    /// See `kept_low`.
    pub kept_high: u32,
    /// How many are kept in the list before them.
    pub before: u32,
}

impl CullBlock {
    /// How many they are.
    pub const CANDIDATES: u32 = 64;
}

/// A list of what is seen: WGSL `CullList`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct CullList {
    /// Its first block of candidates.
    pub first_block: u32,
    /// How many blocks it has.
    pub blocks: u32,
    /// How many trees are in it.
    pub kept: u32,
}

impl CullList {
    /// Invocations that sum up one.
    pub const STRIPS: u32 = 256;
}

/// The arguments of an indirect call that draws a part of many trees, and the list of those: WGSL `CullCall`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct CullCall {
    /// Corners of the part's triangles.
    pub corners: u32,
    /// How many trees.
    pub trees: u32,
    /// 0.
    pub first_corner: u32,
    /// 0.
    pub base_vertex: u32,
    /// 0.
    pub first_tree: u32,
    /// The number of the list.
    pub list: u32,
}

impl Vertex {
    /// Locations 0, 1, 2.
    pub const LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: size_of::<Self>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2],
    };
}

impl Instance {
    /// Locations 3 to 5.
    pub const LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: size_of::<Self>() as u64,
        step_mode: wgpu::VertexStepMode::Instance,
        attributes: &wgpu::vertex_attr_array![3 => Float32x4, 4 => Snorm16x4, 5 => Uint32x2],
    };

    /// A tree where it was made.
    pub const IDENTITY: Self = Self { position: [0.0; 3], scale: 1.0, rotation: [0, 0, 0, i16::MAX], id: 0, extra: 0 };
}
