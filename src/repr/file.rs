//! A built tree as a GLB file and back, bit for bit (DESIGN §5): surfaces and pictures as glTF has them, [`Seen`] and [`Drawn`] beside
//! them in `extras.sphereboard`. What glTF cannot say looks sensible in a plain viewer all the same: of cards that turn, those for the
//! view from the front stand there, and an octahedral impostor is a card with its picture from the front.

use std::collections::BTreeMap;
use std::f32::consts::FRAC_PI_2;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::geom::{Bounds, Surface};
use crate::model::glb::{self, Assembly, Piece, Plainly, Tier};
use crate::model::{About, Growth};
use crate::raster::View;
use crate::{Error, Result, Seed};

use super::card::Card;
use super::{BuiltPart, BuiltTree, Drawn, Facing, Level, Octahedral, Order, REFERENCE_FOCAL_PX, Seen, method, tabled};

/// Version of what we write.
const FORMAT: u32 = 1;

/// Where a built tree comes from: what its file says beside its parts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// What it was built from: a preset or the name of a file.
    pub source: String,
    /// The method that builds the wood, where it was named.
    pub trunk: Option<String>,
    /// Every parameter with its effective value; those of the wood's method with `trunk.` before them, where they were set.
    pub parameters: BTreeMap<String, String>,
    /// Of every random number.
    pub seed: Seed,
}

impl Origin {
    /// Of what `order` builds from the source of that name.
    ///
    /// # Errors
    /// [`Error::UnknownMethod`] or [`Error::UnknownParameter`].
    pub fn of(order: &Order, source: &str) -> Result<Self> {
        let (own, for_trunk) = order.settings.split("trunk.");
        let own = tabled(method(order.method)?, &own)?.into_iter().map(|(name, value)| (name.to_owned(), value));
        let wood = match order.trunk {
            Some(trunk) => tabled(method(trunk)?, &for_trunk)?,
            None => vec![],
        };
        let wood = wood.into_iter().map(|(name, value)| (format!("trunk.{name}"), value));
        let trunk = order.trunk.map(str::to_owned);
        Ok(Self { source: source.to_owned(), trunk, parameters: own.chain(wood).collect(), seed: order.seed })
    }
}

/// `extras.sphereboard` of the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Whole {
    kind: Kind,
    format: u32,
    program: String,
    method: String,
    origin: Origin,
    /// Smallest and largest corner, metres.
    bounds: [Vec3; 2],
    levels: Vec<Level>,
    growth: Option<Growth>,
    parts: usize,
}

/// What tells these files from others of ours.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Built,
}

/// Of each part's node.
#[derive(Serialize, Deserialize)]
struct Placed {
    drawn: Drawn,
    seen: Seen,
    /// What programs that know only glTF do not show of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    needs: Option<String>,
}

/// Which levels go into a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Levels {
    /// All of them.
    All,
    /// That one, by number, seen from wherever one looks.
    One(usize),
}

/// What a part does that glTF has no word for; `None` for one that just stands there.
pub fn beyond_gltf(part: &BuiltPart) -> Option<&'static str> {
    match (&part.drawn, part.seen.facing) {
        (Drawn::Octahedral(_), _) => Some("shows the picture that was taken nearest to the viewer's side"),
        (Drawn::Turned { .. }, _) => Some("turns to the viewer"),
        (Drawn::Forest(_), _) => Some("loses its leaves one by one with distance; the file has them as plain levels"),
        (Drawn::Still, Facing::Toward { .. } | Facing::Sector { .. }) => Some("is seen from some sides only"),
        // Fading edge-on is left out where glTF has no word for it.
        (Drawn::Still, Facing::Any | Facing::Own { .. }) => None,
    }
}

/// Only what is seen at one level, at every distance.
pub fn one_level(built: BuiltTree, number: usize) -> BuiltTree {
    let built = built.plain();
    let Some(level) = built.levels.get(number).cloned() else { return built };
    let always = Seen::default();
    let alone = |part: BuiltPart| {
        let seen = Seen { appears: always.appears, vanishes: always.vanishes, ..part.seen };
        (part.seen.share_at(level.distance) > 0.0).then(|| part.seen(seen))
    };
    BuiltTree { parts: built.parts.into_iter().filter_map(alone).collect(), levels: vec![level], ..built }
}

/// Writes a built tree as a GLB file. Same tree, same bytes.
///
/// # Errors
/// [`Error::Internal`] when it breaks a promise ([`BuiltTree::check`]).
pub fn write(built: &BuiltTree, origin: &Origin) -> Result<Vec<u8>> {
    let built = &built.clone().plain();
    built.check().map_err(|what| Error::Internal { stage: "repr::file", what })?;
    let piece = |part: &'_ BuiltPart| {
        let needs = beyond_gltf(part).map(str::to_owned);
        (Placed { drawn: part.drawn.clone(), seen: part.seen, needs }, plainly(part))
    };
    let pieces = built.parts.iter().map(|part| {
        let (says, plainly) = piece(part);
        Piece { part: &part.part, says, plainly }
    });
    let tier = |level: &Level| Tier {
        name: level.name.clone(),
        covers: screen_share(built, level.distance),
        pieces: (0..built.parts.len()).filter(|&i| built.parts[i].seen.share_at(level.distance) > 0.0).collect(),
    };
    let assembly = Assembly { pieces: pieces.collect(), tiers: built.levels.iter().map(tier).collect() };
    let whole = Whole {
        kind: Kind::Built,
        format: FORMAT,
        program: About::this_program(),
        method: built.method.clone(),
        origin: origin.clone(),
        bounds: [built.bounds.min, built.bounds.max],
        levels: built.levels.clone(),
        growth: built.growth,
        parts: built.parts.len(),
    };
    glb::write_assembly(&assembly, &whole, &whole.program)
}

/// Reads a built tree back; `None` for a file that does not claim to hold one.
///
/// # Errors
/// [`Error::BrokenGlb`], [`Error::ForeignGlb`] or [`Error::GlbVersion`] for one that does, but was damaged or changed by another program.
pub fn read(bytes: &[u8]) -> Option<Result<(BuiltTree, Origin)>> {
    /// Enough to tell whose file it is, without reading its meshes.
    const MARK: &[u8] = br#""kind":"built""#;
    let json = bytes.get(12..16).and_then(|length| length.try_into().ok()).map(u32::from_le_bytes);
    let json = json.and_then(|length| bytes.get(20..(length as usize).checked_add(20)?)).filter(|_| bytes.starts_with(b"glTF"))?;
    json.windows(MARK.len()).any(|window| window == MARK).then(|| read_own(bytes))
}

fn read_own(bytes: &[u8]) -> Result<(BuiltTree, Origin)> {
    let (whole, parts) = glb::read_assembly::<Whole, Placed>(bytes, |whole| whole.parts)?;
    if whole.format != FORMAT {
        return Err(Error::GlbVersion { found: whole.format, known: FORMAT });
    }
    let [min, max] = whole.bounds;
    let built = BuiltTree {
        method: whole.method,
        bounds: Bounds { min, max },
        parts: parts.into_iter().map(|(part, Placed { drawn, seen, .. })| BuiltPart { part, drawn, seen }).collect(),
        levels: whole.levels,
        growth: whole.growth,
        warnings: vec![],
        build_ms: 0.0,
    };
    built.check().map_err(|what| Error::BrokenGlb { what })?;
    Ok((built, whole.origin))
}

/// What a plain viewer shows of a part.
pub(crate) fn plainly(part: &BuiltPart) -> Plainly {
    match &part.drawn {
        // All views of a surface lie on it; the front one is shown.
        Drawn::Still if matches!(part.seen.facing, Facing::Sector { .. }) && part.seen.share_toward(Vec3::Z) < 0.5 => {
            Plainly::Nothing
        }
        Drawn::Still | Drawn::Forest(_) => Plainly::Itself,
        // All views of a turned card stand in one place; the front one is shown.
        Drawn::Turned { .. } if part.seen.share_toward(Vec3::Z) < 0.5 => Plainly::Nothing,
        Drawn::Turned { .. } => Plainly::Itself,
        Drawn::Octahedral(impostor) => Plainly::Other(upright_card(impostor, false)),
    }
}

/// A card with the one frame of an octahedral impostor that looks from +Z, or from +X.
pub(crate) fn upright_card(impostor: &Octahedral, from_x: bool) -> Surface {
    let axes = View::axes_from(if from_x { FRAC_PI_2 } else { 0.0 }, 0.0);
    let center = Vec3::from(axes.map(|axis| axis.dot(impostor.center)));
    let window = Bounds { min: center - impostor.radius_m, max: center + impostor.radius_m };
    let card = Card { name: String::new(), axes, window, plane: center.z, size_px: [1, 1] };
    let surface = card.surface();
    let (grid, last) = (impostor.grid.max(1) as f32, impostor.grid.max(1) as f32 - 1.0);
    let frame = Vec2::new(if from_x { last } else { 0.0 }, last);
    Surface { uvs: surface.uvs.iter().map(|uv| (frame + *uv) / grid).collect(), ..surface }
}

/// How much of a picture of the reference size a tree's box fills at a distance, 0 to 1: what `MSFT_screencoverage` counts in.
fn screen_share(built: &BuiltTree, distance: f32) -> f32 {
    const SIZE_PX: Vec2 = Vec2::new(1920.0, 1080.0);
    let size = built.bounds.size() / built.height_m();
    let px = REFERENCE_FOCAL_PX / distance.max(1e-3) * Vec2::new(size.x.max(size.z), size.y);
    (px / SIZE_PX).min(Vec2::ONE).element_product()
}
