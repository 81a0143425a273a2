//! Which boxes of a tree get pictures (Lluch04 §3.2.4), metres.
//!
//! The paper gives a branch pictures when its box is not too small beside that of its parent. On most trees nearly every branch is too
//! small beside the whole crown, and would be drawn leaf by leaf as soon as the crown's own pictures are too coarse. Hence (ours) branches
//! that are too small for pictures of their own share a box: they are halved in space for as long as the halves' boxes are large enough. A branch that fills nearly the whole box of its parent shows nothing new and is replaced by what grows on it.
//! Boxes are divided from those that save most down, until all that may be are, or there are as many as asked for.

use std::ops::Range;

use glam::Vec3;

use super::branches::{Branches, joined};
use crate::geom::Bounds;

/// A box with pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedBox {
    /// The box that it lies in, by number; `None` for the whole crown, which is number 0.
    pub parent: Option<u32>,
    /// How many boxes it lies in.
    pub depth: u32,
    /// Its leaves, by number.
    pub leaves: Vec<u32>,
    /// Around its leaves.
    pub bounds: Bounds,
    /// Whether other boxes hold its leaves too.
    pub divided: bool,
}

/// What decides about pictures.
#[derive(Debug, Clone, Copy)]
pub struct Rules {
    /// Least volume of a box, as a share of its parent's.
    pub least_share: f32,
    /// Least leaves in a box.
    pub least_leaves: usize,
    /// Most boxes.
    pub most_boxes: usize,
}

/// A branch of more than this share of a box's volume is replaced by what grows on it.
const NEARLY_ALL: f32 = 0.7;

/// The boxes of a tree's leaves, parents before their children. The children of a divided box hold each of its leaves once.
pub fn plan(branches: &Branches, rules: Rules) -> Vec<PlannedBox> {
    let order = Order::of(branches);
    let leaves: Vec<u32> = order.leaves.clone();
    let Some(bounds) = around(branches, &leaves) else { return vec![] };
    let mut boxes = vec![PlannedBox { parent: None, depth: 0, leaves, bounds, divided: false }];
    let mut waiting = vec![(0usize, vec![order.item(0)])];
    loop {
        // The one that would be drawn in most leaves from furthest off; of equals the first.
        let saves =
            |(number, _): &(usize, Vec<Item>)| boxes[*number].leaves.len() as f32 * boxes[*number].bounds.size().max_element();
        let first =
            |a: &usize, b: &usize| saves(&waiting[*a]).total_cmp(&saves(&waiting[*b])).then(waiting[*b].0.cmp(&waiting[*a].0));
        let Some(at) = (0..waiting.len()).max_by(first) else { return boxes };
        let (number, items) = waiting.swap_remove(at);
        let groups = order.divided(items, rules, rules.most_boxes.saturating_sub(boxes.len()));
        if groups.len() < 2 {
            continue;
        }
        boxes[number].divided = true;
        for group in groups {
            let leaves: Vec<u32> = group.iter().flat_map(|item| order.leaves[item.leaves.clone()].iter().copied()).collect();
            let Some(bounds) = around(branches, &leaves) else { continue };
            waiting.push((boxes.len(), group));
            boxes.push(PlannedBox { parent: Some(number as u32), depth: boxes[number].depth + 1, leaves, bounds, divided: false });
        }
    }
}

fn around(branches: &Branches, leaves: &[u32]) -> Option<Bounds> {
    leaves.iter().map(|leaf| branches.leaves[*leaf as usize]).reduce(joined)
}

/// A branch with all that grows on it, or a leaf.
#[derive(Debug, Clone)]
struct Item {
    bounds: Bounds,
    /// Where its leaves stand in the order.
    leaves: Range<usize>,
    /// `None` for a leaf.
    branch: Option<u32>,
}

/// The leaves branch by branch, so that those of a branch and of all that grows on it stand side by side.
struct Order<'a> {
    branches: &'a Branches,
    children: Vec<Vec<u32>>,
    leaves: Vec<u32>,
    /// Of a branch with all that grows on it.
    ranges: Vec<Range<usize>>,
    /// Where its own leaves end, with which its range begins.
    own_ends: Vec<usize>,
}

impl<'a> Order<'a> {
    fn of(branches: &'a Branches) -> Self {
        let count = branches.boxes.len();
        let (mut children, mut own) = (vec![vec![]; count], vec![vec![]; count]);
        for (number, branch) in branches.boxes.iter().enumerate().skip(1) {
            children[branch.parent.unwrap_or(0) as usize].push(number as u32);
        }
        (0..).zip(&branches.branch_of).for_each(|(leaf, branch)| own[*branch as usize].push(leaf));
        let mut order = Self { branches, children, leaves: vec![], ranges: vec![0..0; count], own_ends: vec![0; count] };
        // A stack of our own: chains nest as deeply as they like.
        let mut open = vec![(0usize, 0usize)];
        while let Some((branch, next)) = open.pop() {
            if next == 0 {
                order.ranges[branch].start = order.leaves.len();
                order.leaves.extend(&own[branch]);
                order.own_ends[branch] = order.leaves.len();
            }
            match order.children[branch].get(next) {
                Some(child) => open.extend([(branch, next + 1), (*child as usize, 0)]),
                None => order.ranges[branch].end = order.leaves.len(),
            }
        }
        order
    }

    fn item(&self, branch: u32) -> Item {
        let bounds = self.branches.boxes[branch as usize].bounds.unwrap_or(Bounds { min: Vec3::ZERO, max: Vec3::ZERO });
        Item { bounds, leaves: self.ranges[branch as usize].clone(), branch: Some(branch) }
    }

    /// What grows on a branch: its own leaves one by one, and the branches that bear any.
    fn on(&self, branch: u32) -> impl Iterator<Item = Item> {
        let own = self.ranges[branch as usize].start..self.own_ends[branch as usize];
        let leaf = |at: usize| Item { bounds: self.branches.leaves[self.leaves[at] as usize], leaves: at..at + 1, branch: None };
        let children = self.children[branch as usize].iter().map(|child| self.item(*child));
        own.map(leaf).chain(children.filter(|item| !item.leaves.is_empty()))
    }

    /// The items of a box in groups, each of which gets a box: at most `most` of them. Fewer than two when the box stays whole.
    fn divided(&self, mut items: Vec<Item>, rules: Rules, most: usize) -> Vec<Vec<Item>> {
        let Some(whole) = hull(&items) else { return vec![] };
        let volume = volume(whole);
        let is_all = |item: &Item, count: usize| item.branch.is_some() && (count == 1 || share(item.bounds, volume) > NEARLY_ALL);
        while let Some(at) = items.iter().position(|item| is_all(item, items.len())) {
            let Some(branch) = items.remove(at).branch else { break };
            items.extend(self.on(branch));
        }
        let mut least_share = rules.least_share;
        loop {
            let groups = Grouping { volume, least_share, least_leaves: rules.least_leaves }.groups(items.clone());
            if groups.len() <= most {
                return groups;
            }
            if least_share > 1.0 {
                return vec![];
            }
            least_share = (1.5 * least_share).max(0.01);
        }
    }
}

/// How the items of one box are put into groups.
struct Grouping {
    /// Of the box, m³.
    volume: f32,
    least_share: f32,
    least_leaves: usize,
}

impl Grouping {
    fn groups(&self, items: Vec<Item>) -> Vec<Vec<Item>> {
        let (large, small): (Vec<Item>, Vec<Item>) = items.into_iter().partition(|item| self.suffices(std::slice::from_ref(item)));
        let mut groups: Vec<Vec<Item>> = large.into_iter().map(|item| vec![item]).collect();
        if small.is_empty() {
            return groups;
        }
        if self.suffices(&small) || groups.is_empty() {
            self.halve(small, &mut groups);
            return groups;
        }
        // Too little for a box of its own: each goes to the nearest.
        let middles: Vec<Vec3> = groups.iter().map(|group| hull(group).map_or(Vec3::ZERO, |b| b.center())).collect();
        for item in small {
            let away = |k: &usize| middles[*k].distance_squared(item.bounds.center());
            let nearest = (0..groups.len()).min_by(|a, b| away(a).total_cmp(&away(b))).expect("there is a group");
            groups[nearest].push(item);
        }
        groups
    }

    /// Whether these are enough for a box.
    fn suffices(&self, items: &[Item]) -> bool {
        let leaves: usize = items.iter().map(|item| item.leaves.len()).sum();
        leaves >= self.least_leaves && hull(items).is_some_and(|bounds| share(bounds, self.volume) >= self.least_share)
    }

    /// In two halves of about as many leaves, and these again, for as long as both suffice. Of the three axes, along that which leaves the
    /// least volume in the halves' boxes.
    fn halve(&self, items: Vec<Item>, groups: &mut Vec<Vec<Item>>) {
        let volumes = |[a, b]: &[Vec<Item>; 2]| [a, b].iter().filter_map(|half| hull(half)).map(volume).sum::<f32>();
        let halves = (0..3).map(|axis| halves(&items, axis)).filter(|halves| halves.iter().all(|half| self.suffices(half)));
        match halves.min_by(|a, b| volumes(a).total_cmp(&volumes(b))) {
            Some([low, high]) => {
                self.halve(low, groups);
                self.halve(high, groups);
            }
            None => groups.push(items),
        }
    }
}

/// The items up to the middle leaf along an axis, and the others.
fn halves(items: &[Item], axis: usize) -> [Vec<Item>; 2] {
    let mut sorted = items.to_vec();
    let place = |item: &Item| item.bounds.center()[axis];
    sorted.sort_by(|a, b| place(a).total_cmp(&place(b)).then(a.leaves.start.cmp(&b.leaves.start)));
    let all: usize = sorted.iter().map(|item| item.leaves.len()).sum();
    let mut before = 0;
    let low = sorted.iter().take_while(|item| {
        let is_low = 2 * before < all;
        before += item.leaves.len();
        is_low
    });
    let high = sorted.split_off(low.count());
    [sorted, high]
}

fn hull(items: &[Item]) -> Option<Bounds> {
    items.iter().map(|item| item.bounds).reduce(joined)
}

/// Of a box that is never quite flat, m³.
fn volume(bounds: Bounds) -> f32 {
    let size = bounds.size();
    size.max(Vec3::splat(1e-3 * size.max_element())).element_product()
}

fn share(bounds: Bounds, of: f32) -> f32 {
    if of > 0.0 { volume(bounds) / of } else { 0.0 }
}
