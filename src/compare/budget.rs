//! How much fits the time: what a plan takes is reckoned from the tree's triangles and the number of methods, never measured, so that the
//! same command looks at the same pictures on every machine. A plan that would take longer is thinned out, and says so.

use serde::{Deserialize, Serialize};

use crate::geom::Bounds;

use super::film::ORBIT_PX;
use super::plan::Plan;
use super::truth::finer;

/// What a comparison is expected to take, and what it took.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// Seconds that it may take.
    pub allowed_s: f64,
    /// Seconds that its plan takes on four cores with the software driver, as reckoned from the tree's triangles.
    pub planned_s: f64,
    /// The same by what it goes into.
    pub planned: Spent,
    /// What was left out of the profile to fit, in sentences.
    pub thinned: Vec<String>,
    /// Seconds that it took here, with those of earlier runs of the same comparison that came to their end.
    pub taken_s: f64,
    /// The same by what it went into.
    pub spent: Spent,
    /// Most memory that the process has had, megabytes; `None` where the system does not say.
    pub peak_mb: Option<f64>,
}

/// Seconds by what they go into. What several do side by side counts as a share of the run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Spent {
    /// Pictures and films of the truth.
    pub truth_s: f64,
    /// Building methods, one alone at a time.
    pub build_s: f64,
    /// Timing them, alone.
    pub timing_s: f64,
    /// Writing their files, to weigh them.
    pub files_s: f64,
    /// Their pictures, held against the truth.
    pub pictures_s: f64,
    /// Their films.
    pub motion_s: f64,
    /// All else: getting ready, waiting for each other.
    pub rest_s: f64,
}

impl Spent {
    /// Of a run of so many renderers side by side.
    pub fn of_all<'a>(truth_s: f64, methods: impl Iterator<Item = &'a Self>, workers: usize) -> Self {
        let share = 1.0 / workers.max(1) as f64;
        methods.fold(Self { truth_s, ..Self::default() }, |sum, own| Self {
            build_s: sum.build_s + own.build_s,
            timing_s: sum.timing_s + own.timing_s,
            files_s: sum.files_s + share * own.files_s,
            pictures_s: sum.pictures_s + share * own.pictures_s,
            motion_s: sum.motion_s + share * own.motion_s,
            ..sum
        })
    }

    /// The same with what is left of a whole of so many seconds.
    pub fn of(self, whole_s: f64) -> Self {
        Self { rest_s: (whole_s - self.sum() + self.rest_s).max(0.0), ..self }
    }

    /// All of it.
    pub fn sum(&self) -> f64 {
        self.truth_s + self.build_s + self.timing_s + self.files_s + self.pictures_s + self.motion_s + self.rest_s
    }
}

/// What makes a comparison long.
#[derive(Debug, Clone, Copy)]
pub struct Load {
    /// Of the tree.
    pub triangles: usize,
    /// Width of the box around it, in its heights.
    pub width: f64,
    /// How many take part.
    pub methods: usize,
}

impl Load {
    /// Of a tree in that box.
    pub fn of(triangles: usize, bounds: Bounds, methods: usize) -> Self {
        let size = bounds.size();
        let width = size.x.max(size.z) / bounds.height_m().max(1e-6);
        // A log that lies in the grass is drawn no larger than pictures may be.
        Self { triangles, width: f64::from(width).clamp(0.1, 8.0), methods }
    }
}

/// Milliseconds on four cores with the software driver, where three work side by side: of a thing itself, for 1,000 triangles of the tree,
/// and for 1,000 pixels. Fitted to quick and full comparisons of three presets of 86,000 to 190,000 triangles with all methods, which draw
/// a share of the tree's triangles and have some levels each: the means are in the numbers.
mod cost {
    /// Of a picture of the truth.
    pub const TRUTH: [f64; 3] = [1.0, 0.1, 0.12];
    /// Of building a method.
    pub const BUILD: [f64; 3] = [150.0, 4.6, 0.0];
    /// Of timing a method once: two frames at least, however short the time that is asked for, and what comes before.
    pub const TIMING: [f64; 2] = [60.0, 170.0];
    /// Of its file.
    pub const FILE: [f64; 3] = [90.0, 0.2, 0.0];
    /// Of a picture with its figures.
    pub const PICTURE: [f64; 3] = [2.5, 0.03, 0.2];
    /// Of a frame of a film, with what people would see of it.
    pub const FRAME: [f64; 3] = [8.0, 0.05, 0.2];
    /// Levels of a method, on average.
    pub const LEVELS: f64 = 2.4;
    /// How many methods change with distance: those walk away too.
    pub const CHANGING: f64 = 0.6;
    /// For each millisecond of work those of the rest.
    pub const REST: f64 = 0.13;
}

/// Seconds that `plan` takes.
pub fn planned(plan: &Plan, Load { triangles, width, methods }: Load) -> Spent {
    let (ktri, methods) = (triangles as f64 / 1e3, methods as f64);
    let seconds = |[each, of_ktri, of_kpx]: [f64; 3], kpx: f64| (each + of_ktri * ktri + of_kpx * kpx) / 1e3;
    // What the tree takes of a picture, and a margin.
    let kpx = |height_px: f32, by: u32| width * (1.2 * f64::from(height_px) * f64::from(by)).powi(2) / 1e3;
    let true_picture = |height_px: f32| seconds(cost::TRUTH, kpx(height_px, finer(height_px)));
    let over_heights = |of: &dyn Fn(f32) -> f64| plan.heights_px.iter().map(|&height_px| of(height_px)).sum::<f64>();
    let angles = (plan.views.len() * plan.suns.len()) as f64;
    let firsts = (0..plan.views.len()).filter(|&view| plan.is_first(view)).count() as f64;
    let levels = if plan.levels { cost::LEVELS } else { 0.0 };
    let [round, away] = [plan.motion.orbit_frames, plan.motion.dolly_frames].map(|frames| frames as f64);
    let timings = plan.heights_px.len() as f64 * (1.0 + levels);
    let [timing, least] = cost::TIMING;
    let pictures = (angles + levels * firsts) * over_heights(&|height_px| seconds(cost::PICTURE, kpx(height_px, 1)));
    let work = Spent {
        truth_s: angles * over_heights(&true_picture) + (round + away) * true_picture(ORBIT_PX),
        build_s: methods * seconds(cost::BUILD, 0.0),
        timing_s: methods * timings * (timing + least.max(plan.timing_ms as f64)) / 1e3,
        files_s: methods * seconds(cost::FILE, 0.0),
        pictures_s: methods * pictures,
        motion_s: methods * (round + cost::CHANGING * away) * seconds(cost::FRAME, kpx(ORBIT_PX, 1)),
        rest_s: 0.0,
    };
    work.of((1.0 + cost::REST) * work.sum())
}

/// One way to make a plan smaller: what is left out, and whether there was anything.
type Thinner = fn(&mut Plan) -> Option<String>;

/// What hurts least comes first.
const THINNERS: [Thinner; 8] =
    [above_once, half_the_azimuths, no_levels, half_the_motion, one_sun, half_the_azimuths, half_the_heights, half_the_azimuths];

/// `plan` thinned out until it fits `allowed_s`, or nothing more can be left out.
pub fn fit(mut plan: Plan, load: Load, allowed_s: f64) -> (Plan, Budget) {
    let mut thinned = vec![];
    for thin in THINNERS {
        if planned(&plan, load).sum() <= allowed_s {
            break;
        }
        thinned.extend(thin(&mut plan));
    }
    let planned = planned(&plan, load);
    (plan, Budget { allowed_s, planned_s: planned.sum(), planned, thinned, ..Budget::default() })
}

fn kept(plan: &mut Plan, keep: impl Fn(&Plan, usize) -> bool) -> usize {
    let before = plan.views.len();
    // The photograph's own view is the first, and stays.
    plan.views = (0..before).filter(|&view| keep(plan, view)).map(|view| plan.views[view]).collect();
    before - plan.views.len()
}

fn above_once(plan: &mut Plan) -> Option<String> {
    let gone = kept(plan, |plan, view| plan.views[view].elevation_deg < 90.0 || plan.is_first(view));
    (gone > 0).then(|| "from straight above one azimuth: the others turn the same picture".to_owned())
}

fn half_the_azimuths(plan: &mut Plan) -> Option<String> {
    let number = |plan: &Plan, view: usize| {
        let elevation_deg = plan.views[view].elevation_deg;
        let own = usize::from(plan.photographed.is_some_and(|own| view > own && plan.views[own].elevation_deg == elevation_deg));
        plan.views[..view].iter().filter(|before| before.elevation_deg == elevation_deg).count() - own
    };
    let gone = kept(plan, |plan, view| number(plan, view).is_multiple_of(2));
    (gone > 0).then(|| format!("every other azimuth: {} views are left", plan.views.len()))
}

fn no_levels(plan: &mut Plan) -> Option<String> {
    std::mem::take(&mut plan.levels).then(|| "no level by itself: methods draw those that belong at a distance".to_owned())
}

fn half_the_motion(plan: &mut Plan) -> Option<String> {
    let motion = &mut plan.motion;
    // Steps stay as they are, so that figures mean the same: the walk away begins later.
    let [first, last] = motion.dolly_px;
    motion.dolly_px[0] = (first * last).sqrt();
    motion.dolly_frames /= 2;
    motion.orbit_frames = motion.orbit_frames.div_ceil(2);
    let [first, last] = motion.dolly_px;
    Some(format!("half of the frames in motion: the tree is {first:.0} to {last:.0} px high as one walks away from it"))
}

fn one_sun(plan: &mut Plan) -> Option<String> {
    let several = plan.suns.len() > 1;
    plan.suns.truncate(1);
    several.then(|| "one sun".to_owned())
}

fn half_the_heights(plan: &mut Plan) -> Option<String> {
    let several = plan.heights_px.len() > 2;
    if several {
        let last = plan.heights_px.len() - 1;
        // The farthest stays; the nearest costs most.
        plan.heights_px = (0..=last).filter(|i| (last - i).is_multiple_of(2)).map(|i| plan.heights_px[i]).collect();
    }
    several.then(|| format!("every other distance: {} are left", plan.heights_px.len()))
}

/// Most memory that this process has had, megabytes.
pub fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kib| kib * 1024.0 / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::{Profile, Views};

    fn load(triangles: usize, methods: usize) -> Load {
        Load { triangles, width: 1.0, methods }
    }

    fn seconds(plan: &Plan, triangles: usize, methods: usize) -> f64 {
        planned(plan, load(triangles, methods)).sum()
    }

    #[test]
    fn a_plan_that_fits_is_left_alone_and_one_that_does_not_says_what_is_left_out() {
        let full = Plan::new(Profile::Full, Views::Default, 512);
        let (same, budget) = fit(full.clone(), load(50_000, 15), 1e9);
        assert!(same == full && budget.thinned.is_empty());
        let (fitted, budget) = fit(full.clone(), load(200_000, 15), 0.5 * seconds(&full, 200_000, 15));
        assert!(budget.planned_s <= budget.allowed_s && !budget.thinned.is_empty());
        assert!(fitted.views.iter().filter(|view| view.elevation_deg == 90.0).count() == 1);
        // Nothing fits nothing; what cannot be left out stays.
        let (least, budget) = fit(full, load(2_000_000, 15), 0.0);
        assert!(budget.planned_s > 0.0 && least.pictures() >= 5 && least.suns.len() == 1 && least.heights_px.last() == Some(&16.0));
    }

    #[test]
    fn the_profiles_of_a_tree_of_20_000_leaves_fit_their_times() {
        for (profile, allowed_s) in [(Profile::Quick, 90.0), (Profile::Full, 1200.0)] {
            let plan = Plan::new(profile, Views::Default, 512);
            let (fitted, budget) = fit(plan, load(190_000, 15), allowed_s);
            assert!(budget.planned_s <= allowed_s, "{budget:?}");
            assert!(fitted.heights_px.len() >= 3 && fitted.views.len() >= 6, "{budget:?}");
        }
    }

    #[test]
    fn more_of_anything_takes_longer() {
        let quick = Plan::new(Profile::Quick, Views::Default, 512);
        let base = seconds(&quick, 100_000, 10);
        assert!(seconds(&quick, 200_000, 10) > base && seconds(&quick, 100_000, 11) > base);
        assert!(seconds(&Plan::new(Profile::Full, Views::Default, 512), 100_000, 10) > 5.0 * base);
        let wide = Load { width: 2.0, ..load(100_000, 10) };
        assert!(planned(&quick, wide).pictures_s > planned(&quick, load(100_000, 10)).pictures_s);
    }

    #[test]
    fn memory_is_told_where_the_system_tells_it() {
        if cfg!(target_os = "linux") {
            assert!(peak_mb().is_some_and(|mb| mb > 1.0));
        }
    }
}
