//! What can go wrong, as types: one variant per cause, each saying what was expected, what was found and what to do.
//!
//! The file is long because it is one table, a block of variants per stage. Every stage returns the same [`Error`]: a file within an option
//! within a view wraps another's, and whoever prints or matches one asks a single type. Enums of their own would only be taken apart again.

mod warning;

use std::path::PathBuf;

pub use warning::Warning;

/// The library's result type.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Every failure of the library. The command line prints `Display` after the name of the photograph.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter outside its range, or of the wrong kind.
    #[error("{name} must be {expected}, but is {found}; correct it or leave it out")]
    Parameter {
        /// The parameter as the command line spells it.
        name: String,
        /// Its range or its choices.
        expected: String,
        /// The offending value.
        found: String,
    },
    /// A parameter name that no table holds.
    #[error("there is no parameter {name}; known here are {known}")]
    UnknownParameter {
        /// What was asked for.
        name: String,
        /// The names of the table.
        known: String,
    },
    /// A file that could not be read.
    #[error("cannot read {path}: {cause}; check the path and its permissions")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// A file that could not be written. Nothing is left behind.
    #[error("cannot write {path}: {cause}; check free space and permissions, or choose another folder")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// A file where the folder for the results should be.
    #[error("expected a folder for the results, but {path} is a file; choose another folder")]
    NotAFolder {
        /// The file.
        path: PathBuf,
    },
    /// Two photographs whose outputs would have one name.
    #[error("{first} and {second} would both be written as {stem}.*; rename one of them, or run them into two folders with --out")]
    SameStem {
        /// The common file name without extension.
        stem: String,
        /// The photograph named first.
        first: PathBuf,
        /// The photograph named later.
        second: PathBuf,
    },
    /// Options that cannot be used together.
    #[error("{what}; {remedy}")]
    Usage {
        /// What does not fit.
        what: String,
        /// What to do instead.
        remedy: &'static str,
    },
    /// A result that would replace what it is made from.
    #[error("{input} is read as a photograph or a mask and would be overwritten by a result; choose another folder or rename it")]
    OverwritesInput {
        /// The file.
        input: PathBuf,
    },
    /// What is wrong with the file that an option names.
    #[error("{flag}: {cause}")]
    InOption {
        /// The option as the command line spells it.
        flag: &'static str,
        /// What is wrong.
        cause: Box<Error>,
    },
    // ---- Reading the photograph: files.rs, photo/decode.rs ----
    /// What is wrong with the contents of a file.
    #[error("{path}: {cause}")]
    InFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        cause: Box<Error>,
    },
    /// A path that names nothing.
    #[error("there is no file {path}; check the spelling and the folder")]
    NoSuchFile {
        /// What was asked for.
        path: PathBuf,
    },
    /// A folder or a device where a file was expected.
    #[error("expected a file, but {path} is {found}; name the files themselves")]
    NotAFile {
        /// What was asked for.
        path: PathBuf,
        /// What stands there.
        found: &'static str,
    },
    /// A file longer than any photograph within the pixel limit.
    #[error("expected a file of at most {limit_mb} MB, but {path} has {found_mb} MB; shrink the picture or raise --max-megapixels")]
    FileTooLong {
        /// The file.
        path: PathBuf,
        /// Its length.
        found_mb: u64,
        /// The longest accepted.
        limit_mb: u64,
    },
    /// A file of no bytes.
    #[error("expected a photograph, but the file is empty (0 bytes); copy it again from its source")]
    EmptyFile,
    /// Bytes of some other kind.
    #[error("expected a JPEG, PNG, WebP, TIFF or BMP picture, but the file holds {found}; save it as JPEG or PNG")]
    NotAnImage {
        /// What the first bytes look like.
        found: &'static str,
    },
    /// A picture beyond the pixel limit, refused before memory is allocated for it.
    #[error(
        "expected at most {limit_megapixels} megapixels, but the picture is {width}×{height} px ({:.1} megapixels); shrink it or raise --max-megapixels",
        f64::from(*width) * f64::from(*height) / 1e6
    )]
    TooManyPixels {
        /// Columns that the header declares.
        width: u32,
        /// Rows that the header declares.
        height: u32,
        /// The limit in force.
        limit_megapixels: f64,
    },
    /// A picture that stops before its end.
    #[error("expected a whole {format} picture, but the file ends early after {length} bytes; copy it again from its source")]
    Truncated {
        /// The kind of picture.
        format: &'static str,
        /// Bytes that are there.
        length: usize,
    },
    /// A picture whose bytes contradict each other.
    #[error("expected a sound {format} picture, but it is damaged ({cause}); copy it again or save it anew")]
    DamagedImage {
        /// The kind of picture.
        format: &'static str,
        /// What the decoder said.
        cause: String,
    },
    /// A valid picture of a rare kind.
    #[error("expected a common kind of {format} picture, but this one cannot be read ({cause}); save it as 8-bit JPEG or PNG")]
    UnsupportedImage {
        /// The kind of picture.
        format: &'static str,
        /// What the decoder said.
        cause: String,
    },
    // -- silhouette and crown --
    /// A crown mask without pixels, or with too few for an outline.
    #[error("the crown mask needs at least {needed} connected pixels, but has {found}; mark the crown with --rect or --mask")]
    CrownTooSmall {
        /// Smallest number of pixels that has an outline worth modelling.
        needed: usize,
        /// What there is.
        found: usize,
    },
    /// Two masks of one photograph that do not match.
    #[error("the {what} has {}×{} pixels, but {}×{} were expected; give masks of the photograph's own size", found.0, found.1, expected.0, expected.1)]
    MaskSize {
        /// Which mask.
        what: &'static str,
        /// Width and height expected.
        expected: (u32, u32),
        /// Width and height found.
        found: (u32, u32),
    },
    /// An outline that encloses nothing.
    #[error("view {view} of the tree has no usable outline: {why}; check its mask")]
    Outline {
        /// Which view, from 0.
        view: usize,
        /// What is wrong.
        why: String,
    },
    // ---- Reading models: model/glb ----
    /// Bytes that are no sound GLB file.
    #[error("expected a sound GLB file, but {what}; copy it again or write it anew with `sphereboard model`")]
    BrokenGlb {
        /// What is wrong with it.
        what: String,
    },
    /// A GLB file of some other program, or rearranged by one.
    #[error("expected a tree model as `sphereboard model` writes it, but {what}; write it anew from the photograph")]
    ForeignGlb {
        /// What is missing or different.
        what: String,
    },
    /// A model in another version of our format.
    #[error("expected version {known} of a tree model's extras, but the file has {found}; use the program that wrote it")]
    GlbVersion {
        /// The version found.
        found: u32,
        /// The version that this program reads.
        known: u32,
    },
    // Segmentation.
    /// Too few pixels to hold a crown.
    #[error("the picture has {width}×{height} pixels, but a crown needs at least 16×16; give a larger photograph")]
    PictureTooSmall {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Sky only, or one colour.
    #[error(
        "the picture shows nothing but {what}, and a tree is expected; give a photograph of one tree, or its crown with --mask FILE"
    )]
    NothingToSee {
        /// What fills it: "sky", "one colour".
        what: &'static str,
    },
    /// Nothing in the picture looks like leaves.
    #[error(
        "no foliage found{within}: the dominant hue is {hue_deg:.0}° ({name}); if that is the crown's colour, give --hue {}, or draw the \
         crown and give --mask FILE", hues_around(*.hue_deg)
    )]
    NoFoliage {
        /// Where or in which range was looked, with a leading space; may be empty.
        within: String,
        /// The hue that most of the coloured pixels have, degrees.
        hue_deg: f64,
        /// Its name.
        name: &'static str,
    },
    /// Bare branches.
    #[error(
        "the tree seems to be leafless: twigs against the sky, and no crown of foliage above the ground; give a photograph in leaf, \
         or draw the crown and give --mask FILE"
    )]
    Leafless,
    /// A hint that contradicts the picture or itself.
    #[error("{flag} must be {expected}, but is {found}; correct it or leave it out")]
    Hint {
        /// The option.
        flag: &'static str,
        /// What it may be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// A result that breaks the library's own promise: a bug, not a user's mistake.
    #[error("internal check failed in {stage}: {what}; please report this with the photograph and the parameters")]
    Internal {
        /// Where.
        stage: &'static str,
        /// Which promise.
        what: String,
    },
    // Rasteriser, exemplar and texture.
    /// A view that cannot be drawn.
    #[error(
        "a view needs 1 to 16384 pixels a side, a finite direction and a positive half-height, but has {found}; give another size"
    )]
    View {
        /// Its size.
        found: String,
    },
    /// A surface whose arrays do not belong together.
    #[error("a surface needs polygons over its own vertices and one normal and texture coordinate per vertex, but has {found}")]
    Surface {
        /// What does not fit.
        found: String,
    },
    /// A crown without foliage to cut an exemplar from.
    #[error(
        "the texture needs at least 2×2 pixels of foliage inside the crown, but there is {found}; mark the crown with --mask or --rect"
    )]
    Exemplar {
        /// What there is instead.
        found: String,
    },
    /// What is wrong with one of several photographs of a tree.
    #[error("view {view} of the tree: {cause}")]
    InView {
        /// Its place among the views, from 0.
        view: usize,
        /// What is wrong.
        cause: Box<Error>,
    },
    /// A crown mesh that cannot be textured.
    #[error("the texture needs a closed crown mesh around its centre, but has {found}; try --detail medium or another seed")]
    Untexturable {
        /// What there is instead.
        found: String,
    },
    // ---- The graphics device: gpu/, render/ ----
    /// No adapter of the wanted kind.
    #[error(
        "there is no graphics adapter for --adapter {wanted} (found: {}); `sphereboard doctor` says what to install",
        if found.is_empty() { "none".to_owned() } else { found.join(", ") }
    )]
    NoAdapter {
        /// The choice as the command line spells it.
        wanted: String,
        /// The names of those that are there.
        found: Vec<String>,
    },
    /// The driver refused or gave up.
    #[error("the graphics adapter {adapter} failed: {what}; try --adapter software, a smaller picture, or `sphereboard doctor`")]
    Device {
        /// Its name.
        adapter: String,
        /// The driver's words.
        what: String,
    },
    /// No window, or none that can be drawn into.
    #[error("a window cannot be opened: {what}; on a machine without a screen use `sphereboard render`, or xvfb-run")]
    NoWindow {
        /// What the window system said.
        what: String,
    },
    /// A picture that the adapter cannot hold.
    #[error(
        "a picture must have 1 to {limit} pixels a side on this adapter and at most {megapixels} megapixels, but {}×{} were asked for; \
         choose another --size",
        found[0], found[1]
    )]
    PictureSize {
        /// Width and height asked for.
        found: [u32; 2],
        /// The adapter's longest side.
        limit: u32,
        /// The most pixels, in 2²⁰.
        megapixels: u64,
    },
    // ---- Importing trees: model/import, model/reference ----
    /// A file that is no model.
    #[error("expected a tree as GLB, glTF or OBJ, but the file holds {found}; export it as GLB")]
    NotAModel {
        /// What the first bytes look like.
        found: &'static str,
    },
    /// A model file whose parts contradict each other.
    #[error("expected a sound {format} file, but {what}; export it again")]
    BrokenModel {
        /// The kind of file.
        format: &'static str,
        /// What is wrong with it.
        what: String,
    },
    /// A glTF file that means nothing without an extension that cannot be read.
    #[error("the file needs the glTF extension {name}, which is not read here; {remedy}")]
    GltfExtension {
        /// The extension.
        name: String,
        /// What to do instead.
        remedy: &'static str,
    },
    /// A model file in which there is nothing to see.
    #[error(
        "expected a tree, but the file holds no triangles{why}; export the tree's meshes, not only its armature or an empty scene"
    )]
    EmptyModel {
        /// What there is instead, with a leading space; may be empty.
        why: String,
    },
    /// A material that the file does not have.
    #[error("{flag} names the material {asked}, but the file has {known}; copy the name from `sphereboard inspect`")]
    UnknownMaterial {
        /// The option.
        flag: &'static str,
        /// What was asked for.
        asked: String,
        /// What there is.
        known: String,
    },
    // ---- Grown trees: plant/{grammar, module, derive, turtle}.rs ----
    /// Text that is no L-system, or an L-system that asks for the impossible.
    #[error("line {line}, column {column}: expected {expected}, but found {found}; correct the L-system there")]
    Grammar {
        /// Line of the text, from 1.
        line: u32,
        /// Column of that line in characters, from 1.
        column: u32,
        /// What could stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A grammar that explodes, stopped before memory is taken.
    #[error("derivation {step} would make {found} {what}, and {limit} are allowed; lower the age or raise --max-modules")]
    TooManyModules {
        /// The derivation that was refused, from 1.
        step: u32,
        /// Modules, or numbers in their parentheses.
        what: &'static str,
        /// How many there would be.
        found: u64,
        /// The limit in force.
        limit: u64,
    },
    /// A chain that the turtle cannot follow.
    #[error("module {} of the chain, {name}: expected {expected}, but found {found}; correct the rule that makes it", module + 1)]
    Turtle {
        /// Which module, from 0.
        module: u64,
        /// Its name.
        name: String,
        /// What the turtle could follow.
        expected: &'static str,
        /// What it got.
        found: String,
    },
    // ---- Procedural multiresolution: plant/multires ----
    /// A chain of modules that has no branches to sort.
    #[error(
        "expected a chain of modules with balanced brackets, but module {} {what}; correct the axiom or the rule that makes it", position + 1
    )]
    UnreadableChain {
        /// The module, counted from 0.
        position: usize,
        /// What is wrong with it.
        what: &'static str,
    },
    /// Bytes that are no beginning of a multichain's stream.
    #[error("expected the byte stream of a multichain, but byte {offset} {what}; send it again from its source")]
    BrokenStream {
        /// Where, counted from 0.
        offset: usize,
        /// What is wrong there.
        what: &'static str,
    },
    // ---- Growth and smoothing of outlines ----
    /// A picture too large for the buffers that list pixels on outlines.
    #[error("outlines grow and get smooth in pictures of up to {limit_px} pixels on this adapter, but {}×{} were asked for; choose another --size or --stage unshaped", found[0], found[1])]
    OutlineSize {
        /// Width and height asked for.
        found: [u32; 2],
        /// How many pixels there may be.
        limit_px: u64,
    },
    // ---- Grown trees: model/grown.rs ----
    /// An L-system that draws nothing.
    #[error("nothing grew: the L-system draws neither wood nor leaves at this age; raise --age, or check its rules and commands")]
    NothingGrew,
    /// A picture for bark or leaves that cannot be used.
    #[error("expected a PNG, JPEG or WebP picture, but {} {what}; give another one", path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, to follow its name.
        what: String,
    },
    /// Neither a preset nor a file.
    #[error(
        "expected a preset ({known}) or the file of an L-system, but found {found}; `sphereboard grow --list` describes the presets"
    )]
    UnknownSystem {
        /// The presets.
        known: String,
        /// What was asked for.
        found: String,
    },
    // ---- Comparing pictures: metrics/ ----
    /// Two pictures that cannot be compared pixel by pixel.
    #[error("two pictures of one size are needed, but these have {}×{} and {}×{} pixels; draw both at the same --size", a[0], a[1], b[0], b[1])]
    UnlikeSizes {
        /// Width and height of the first.
        a: [u32; 2],
        /// Width and height of the second.
        b: [u32; 2],
    },
    // ---- Tree representations: repr/ ----
    /// No such representation.
    #[error("expected a method ({known}), but found {found}; `sphereboard methods` describes them")]
    UnknownMethod {
        /// Those that would do.
        known: String,
        /// What was asked for.
        found: String,
    },
    /// A method that cannot stand for this tree.
    #[error("the method {method} cannot take {source_name}: {why}; `sphereboard methods` says what each method takes")]
    NotApplicable {
        /// The method.
        method: &'static str,
        /// The tree.
        source_name: String,
        /// Why not.
        why: String,
    },
    // ---- Comparisons: compare/ ----
    /// A line in a file of views that is none.
    #[error("expected `AZIMUTH ELEVATION` in degrees (-360 to 360, -90 to 90) in line {line} of the views, but found: {found}")]
    ViewLine {
        /// Counted from 1.
        line: usize,
        /// What it says.
        found: String,
    },
    /// The folder of another comparison.
    #[error(
        "{folder} holds another comparison (of another tree, plan, seed, version or adapter); choose another folder, or drop what is there with --anew"
    )]
    OtherComparison {
        /// The folder.
        folder: PathBuf,
    },
    // ---- Photographs of reference trees: report/studio ----
    /// Neither a preset nor a file.
    #[error(
        "expected a preset ({known}) or the file of a model, but found {found}; `sphereboard grow --list` describes the presets"
    )]
    UnknownTree {
        /// The presets.
        known: String,
        /// What was asked for.
        found: String,
    },
    /// A camera under the lawn.
    #[error(
        "expected a camera above the ground, but at an elevation of {elevation_deg:.1}° and {distance_m:.1} m off it is at {eye_m:.1} m, below the ground; raise --elevation-deg, or leave it out to stand on the lawn"
    )]
    BelowGround {
        /// Elevation asked for.
        elevation_deg: f32,
        /// Height of the camera above the ground.
        eye_m: f32,
        /// How far it stands from the tree.
        distance_m: f32,
    },

    // ---- what building may take (`repr::limits`)
    /// The pictures of a built tree take more than was allowed.
    #[error(
        "the pictures that {method} makes take {found_mb:.1} MB with their smaller sizes, but the budget is {budget_mb} MB; {remedy}"
    )]
    TextureBudget {
        /// The method.
        method: String,
        /// What they take.
        found_mb: f64,
        /// What they may take.
        budget_mb: f64,
        /// What to lower.
        remedy: String,
    },
    /// A tree that would not fit into memory.
    #[error(
        "{source_name} has {found} triangles, but a tree to build from may have {most} (this one would take about {gb} GB of memory); leave out small twigs, or export it with fewer leaves"
    )]
    TreeTooLarge {
        /// The tree.
        source_name: String,
        /// Its triangles.
        found: usize,
        /// Those that it may have.
        most: usize,
        /// What they would take.
        gb: usize,
    },
    // ---- Streams of boxes: repr/box_hierarchy ----
    /// A folder that holds no stream of boxes, or a damaged one.
    #[error(
        "expected a stream of boxes, but its {file} {what}; write it again with `sphereboard bake --method box-hierarchy --stream`"
    )]
    BrokenBoxStream {
        /// Which of its files.
        file: String,
        /// What is wrong with it.
        what: String,
    },
    // ---- Captured cards: repr/card ----
    /// Pictures of a tree that would take too much memory.
    #[error(
        "expected the pictures of a tree to take at most {limit_mib} MiB, but {pictures} of this size would take {found_mib} MiB; lower {lower}"
    )]
    TooManyPictures {
        /// What they may take.
        limit_mib: u64,
        /// How many there would be.
        pictures: usize,
        /// What they would take.
        found_mib: u64,
        /// The parameters to lower.
        lower: &'static str,
    },
    // ---- Sources: repr/source ----
    /// What another method has made of a tree, given as the tree.
    #[error("expected a tree, but {path} is already a stand-in ({method} of {source_name}); name its source instead")]
    AlreadyBuilt {
        /// The file or folder.
        path: PathBuf,
        /// The method.
        method: String,
        /// What it was built from.
        source_name: String,
    },
    // ---- Comparisons: compare ----
    /// Somebody else's stand-in that stands elsewhere than the tree.
    #[error(
        "expected {path} to stand where the tree stands ({expected}), but it spans {found}; export it in metres, +Y up, its foot at the tree's"
    )]
    OtherTree {
        /// Its file.
        path: PathBuf,
        /// The tree's box.
        expected: String,
        /// Its own.
        found: String,
    },
    /// Not the data of a comparison.
    #[error("expected the report.json of a comparison, but {what}; make one with `sphereboard compare`")]
    BrokenReport {
        /// What is wrong with it.
        what: String,
    },
    /// A chain of no stand-in.
    #[error(
        "no stand-in has a mean FLIP of {max_flip} or less at any distance, so that there is no chain to write; allow more with --max-flip"
    )]
    NoChain {
        /// What was allowed.
        max_flip: f64,
    },
    // ---- Ground, camera paths: geom/height_field, grove ----
    /// Heights that cannot be ground.
    #[error("expected {expected}, but found {found}; {remedy}")]
    Ground {
        /// What it may be.
        expected: String,
        /// What it is.
        found: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A camera path that cannot be followed.
    #[error("{place}: expected {expected}, but found {found}; correct it, or take the path tour or orbit")]
    CameraPath {
        /// Which line or key.
        place: String,
        /// What belongs there.
        expected: String,
        /// What stands there.
        found: String,
    },
    // Many trees (render::crowd)
    /// A tree of a species that is not there.
    #[error("a tree is of species {found}, but there are {species}; number them from 0")]
    NoSuchSpecies {
        /// Its number.
        found: u16,
        /// How many species there are.
        species: usize,
    },
    /// More trees than memory should hold.
    #[error(
        "expected at most {most} trees, but {asked} were asked for, which would take about {gb:.0} GB of memory; ask for fewer"
    )]
    TooManyTrees {
        /// How many were asked for.
        asked: u64,
        /// What they would take.
        gb: f64,
        /// How many there may be.
        most: u64,
    },
    /// A list of trees that cannot be read at all.
    #[error("expected {expected}, but found {found}; give a CSV table with such a line, or GeoJSON points")]
    Inventory {
        /// What a list has.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A scene file that does not say what a scene is.
    #[error("line {line} of the scene: {what}; see `sphereboard grove --help` for what a scene has")]
    SceneFile {
        /// Where.
        line: usize,
        /// What is wrong with it.
        what: String,
    },
    // What a grove is planted with from photographs.
    /// A folder of photographs that holds none, or too many.
    #[error("expected a folder with photographs of trees, up to 4096, but found {found} in {}; name another with --photos", folder.display())]
    Photos {
        /// Which folder.
        folder: PathBuf,
        /// What is in it.
        found: String,
    },
    // Culling on the device (render::crowd)
    /// More than an adapter's shaders can be given at once.
    #[error("{what} take {needed_mb:.0} MB, but shaders on {adapter} are given at most {most_mb:.0} MB at a time; {instead}")]
    ShaderRoom {
        /// Which adapter.
        adapter: String,
        /// What takes it.
        what: &'static str,
        /// How much.
        needed_mb: f64,
        /// How much there is.
        most_mb: f64,
        /// What to do.
        instead: &'static str,
    },
}

/// A hue range 30° to both sides, as `--hue` takes it: reds begin below 0.
fn hues_around(hue_deg: f64) -> String {
    let middle = if hue_deg > 330.0 { hue_deg - 360.0 } else { hue_deg };
    format!("{:.0}..{:.0}", middle - 30.0, middle + 30.0)
}
