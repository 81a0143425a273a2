//! Rebollo's arrays and algorithms as they are printed, against what they should do: the nine-leaf example of fig. 2–8, and four slips.

use proptest::prelude::*;

use super::forest::{Forest, LeafId};
use super::resolution::Resolution;
use super::simplify::{Collapse, Corner};

/// Fig. 6, left: heirs, what they absorb, in order; each makes the leaf with the next number.
fn nine_leaves() -> (Forest, Vec<Collapse>) {
    let pairs = [(0, 1), (2, 9), (5, 6), (7, 8), (3, 10), (4, 11)];
    let corner = |leaf| Corner { leaf, corner: 0, turned: false };
    // Whose corners they are does not matter here; they only have to be of the cluster.
    let any = [0, 0, 4, 7, 0, 4].map(|leaf| [corner(leaf); 4]);
    let collapses: Vec<_> =
        pairs.into_iter().zip(any).map(|((heir, absorbed), corners)| Collapse { heir, absorbed, corners }).collect();
    (Forest::new(9, &collapses), collapses)
}

/// A leaf of the cluster by its number among all leaves, as the figures have it.
fn global(forest: &Forest, cluster: u32, number: u16) -> u32 {
    let members = forest.members(cluster);
    match usize::from(number).checked_sub(members.len()) {
        None => members[usize::from(number)],
        Some(made) => {
            let nth = forest.changed_groups().iter().enumerate().filter(|(_, c)| **c == cluster).nth(made).unwrap().0;
            (forest.leaves() + nth) as u32
        }
    }
}

/// Fig. 5 and 8: `leaf_number` and `next` of a cluster. Originals are linked first, then what is made, both in order of place.
fn printed_list(forest: &Forest, cluster: u32) -> Vec<(u32, usize)> {
    let order = forest.order(cluster);
    let size = forest.size(cluster);
    let (originals, made): (Vec<usize>, Vec<usize>) = (0..order.len()).partition(|&place| usize::from(order[place]) < size);
    let chain: Vec<usize> = originals.into_iter().chain(made).collect();
    // The last link is never followed; the figures print n1 there.
    let mut next = vec![1; order.len()];
    for pair in chain.windows(2) {
        next[pair[0]] = pair[1];
    }
    order.iter().zip(next).map(|(&number, next)| (global(forest, cluster, number), next)).collect()
}

/// Algorithm 3 for one cluster, as printed.
fn visited_as_printed(list: &[(u32, usize)], init_group: usize, active_leaves: usize) -> Vec<u32> {
    let mut at = init_group;
    (0..active_leaves)
        .map(|_| {
            let (leaf, next) = list[at];
            at = next;
            leaf
        })
        .collect()
}

fn shown(forest: &Forest, cluster: u32, collapsed: usize) -> Vec<u32> {
    forest.shown(cluster, collapsed).map(|number| global(forest, cluster, number)).collect()
}

#[test]
fn the_nine_leaves_fall_into_the_clusters_of_figures_4_to_6() {
    let (forest, _) = nine_leaves();
    assert_eq!(forest.clusters(), 3);
    assert_eq!((forest.members(0), forest.members(1), forest.members(2)), (&[0, 1, 2, 3][..], &[4, 5, 6][..], &[7, 8][..]));
    assert_eq!(printed_list(&forest, 0), [(0, 1), (1, 2), (2, 4), (9, 5), (3, 3), (10, 6), (13, 1)]);
    assert_eq!(printed_list(&forest, 1), [(5, 1), (6, 2), (4, 3), (11, 4), (14, 1)]);
    assert_eq!(printed_list(&forest, 2), [(7, 1), (8, 2), (12, 1)]);
    assert_eq!(forest.changed_groups(), [0, 0, 1, 2, 0, 1]);
    let finest = Resolution::finest(&forest);
    let fields = |r: &Resolution| [0, 1, 2].map(|g| (r.init_group(g), r.active_leaves(&forest, g)));
    assert_eq!(fields(&finest), [(0, 4), (0, 3), (0, 2)]);
    let mut after_three = finest;
    after_three.set_uniform(&forest, 6);
    assert_eq!(fields(&after_three), [(4, 2), (2, 2), (0, 2)], "fig. 8");
}

#[test]
fn printed_links_visit_a_leaf_that_is_gone_where_ours_visit_those_that_stand() {
    let (forest, _) = nine_leaves();
    let list = printed_list(&forest, 0);
    assert_eq!(visited_as_printed(&list, 4, 2), [3, 9], "l9 was consumed by the second collapse");
    assert_eq!(shown(&forest, 0, 2), [3, 10]);
    assert_eq!([0, 1, 2, 3].map(|c| shown(&forest, 0, c)), [vec![0, 1, 2, 3], vec![2, 9, 3], vec![3, 10], vec![13]]);
    assert_eq!([0, 1, 2].map(|c| shown(&forest, 1, c)), [vec![5, 6, 4], vec![4, 11], vec![14]]);
    assert_eq!(forest.next(0, 1), Some([2, 4, 5]), "l2 and l9 make l10");
    assert_eq!(forest.next(2, 1), None);
}

#[test]
fn algorithm_2_as_printed_splits_the_wrong_cluster() {
    let (forest, _) = nine_leaves();
    let groups = forest.changed_groups();
    // As printed: the cluster is read, then `index` steps back.
    let mut collapsed = [2usize, 1, 0];
    let mut index = 3;
    collapsed[groups[index] as usize] = collapsed[groups[index] as usize].wrapping_sub(1);
    index -= 1;
    assert_eq!((index, collapsed), (2, [2, 1, usize::MAX]), "cluster 2 had no collapse to take back");
    // Set right: first back, then read.
    let mut ours = Resolution::finest(&forest);
    ours.set_uniform(&forest, 6);
    let changes = ours.set_uniform(&forest, 7);
    assert_eq!(changes.iter().map(|c| (c.cluster, c.from, c.to)).collect::<Vec<_>>(), [(1, 1, 0)]);
    assert_eq!([0, 1, 2].map(|g| ours.collapsed(g)), [2, 0, 0]);
}

#[test]
fn algorithm_4_as_printed_adds_where_it_must_subtract() {
    let (forest, _) = nine_leaves();
    let (active_leaves, n_leaves, init_group) = (2isize, 3isize, 4isize);
    let printed = init_group - 2 * (n_leaves + active_leaves);
    assert!(printed < 0, "before the first leaf of the cluster: {printed}");
    assert_eq!(init_group - 2 * (n_leaves - active_leaves), 2);
    let mut ours = Resolution::finest(&forest);
    ours.set_variable(&forest, |_| 2);
    ours.set_variable(&forest, |g| if g == 0 { 1 } else { 2 });
    assert_eq!((ours.init_group(0), ours.active_leaves(&forest, 0)), (2, 3));
}

#[test]
fn a_uniform_change_after_a_variable_one_as_printed_starts_from_a_level_that_is_not_there() {
    let (forest, _) = nine_leaves();
    // Nine leaves, `index` 0; then a variable change leaves 13 alone in cluster 0: six leaves, `index` still 0.
    let mut collapsed = [3usize, 0, 0];
    let (mut index, n_collapse) = (0, 1);
    for _ in 0..n_collapse {
        collapsed[forest.changed_groups()[index] as usize] += 1;
        index += 1;
    }
    assert_eq!((index, collapsed[0]), (1, 4), "a fourth collapse of a cluster that has three");
    let mut ours = Resolution::finest(&forest);
    ours.set_variable(&forest, |g| if g == 0 { 3 } else { 0 });
    assert_eq!(ours.shown(), 6);
    let changes = ours.set_uniform(&forest, 5);
    assert_eq!([0, 1, 2].map(|g| ours.collapsed(g)), [2, 1, 1]);
    assert_eq!((ours.shown(), changes.len()), (5, 3));
}

/// Any sequence of collapses of that many leaves.
fn any_forest() -> impl Strategy<Value = (usize, Vec<Collapse>)> {
    (1usize..40, proptest::collection::vec((any::<u32>(), any::<u32>(), any::<u32>()), 0..40)).prop_map(|(leaves, draws)| {
        let mut alive: Vec<u32> = (0..leaves as u32).collect();
        let mut corners: Vec<[Corner; 4]> =
            (0..leaves as u32).map(|leaf| [0, 1, 2, 3].map(|corner| Corner { leaf, corner, turned: false })).collect();
        let mut collapses = vec![];
        for (one, two, pick) in draws {
            if alive.len() < 2 {
                break;
            }
            let heir = alive.swap_remove(one as usize % alive.len());
            let absorbed = alive.swap_remove(two as usize % alive.len());
            let made = std::array::from_fn(|k| {
                let from = if pick >> k & 1 == 0 { heir } else { absorbed };
                Corner { turned: pick >> (k + 4) & 1 == 1, ..corners[from as usize][(pick >> (8 + 2 * k) & 3) as usize] }
            });
            alive.push(corners.len() as u32);
            corners.push(made);
            collapses.push(Collapse { heir, absorbed, corners: made });
        }
        (leaves, collapses)
    })
}

/// Which leaves stand, and what they look like, told by following the collapses one by one.
fn by_the_book(leaves: usize, collapses: &[Collapse], index: usize) -> Vec<(u32, [Corner; 4], u32)> {
    let mut all: Vec<_> =
        (0..leaves as u32).map(|leaf| (leaf, [0, 1, 2, 3].map(|corner| Corner { leaf, corner, turned: false }), leaf)).collect();
    let mut gone = vec![false; leaves + collapses.len()];
    for (i, collapse) in collapses[..index].iter().enumerate() {
        gone[collapse.heir as usize] = true;
        gone[collapse.absorbed as usize] = true;
        all.push(((leaves + i) as u32, collapse.corners, all[collapse.heir as usize].2));
    }
    all.retain(|(leaf, ..)| !gone[*leaf as usize]);
    all
}

fn standing(forest: &Forest, resolution: &Resolution) -> Vec<(u32, [Corner; 4], u32)> {
    let of_cluster = |cluster| {
        forest.shown(cluster, resolution.collapsed(cluster)).map(move |number| {
            let shape = forest.shape(LeafId { cluster, number });
            (global(forest, cluster, number), shape.corners, shape.wears)
        })
    };
    let mut all: Vec<_> = (0..forest.clusters() as u32).flat_map(of_cluster).collect();
    all.sort_unstable_by_key(|leaf| leaf.0);
    all
}

proptest! {
    #[test]
    fn every_level_shows_just_the_leaves_that_stand((leaves, collapses) in any_forest(), walk in proptest::collection::vec(0usize..50, 1..8)) {
        let forest = Forest::new(leaves, &collapses);
        prop_assert_eq!(forest.clusters(), leaves - collapses.len());
        let mut resolution = Resolution::finest(&forest);
        prop_assert_eq!(standing(&forest, &resolution), by_the_book(leaves, &collapses, 0));
        for wanted in walk {
            let before = resolution.clone();
            let changes = resolution.set_uniform(&forest, wanted);
            let index = leaves.saturating_sub(wanted).min(collapses.len());
            prop_assert_eq!(resolution.shown(), leaves - index);
            prop_assert_eq!(standing(&forest, &resolution), by_the_book(leaves, &collapses, index));
            // Each cluster that changed is told once, and no other.
            let told: Vec<u32> = changes.iter().map(|c| c.cluster).collect();
            let differ: Vec<u32> = (0..forest.clusters() as u32).filter(|&g| before.collapsed(g) != resolution.collapsed(g)).collect();
            prop_assert_eq!(told, differ);
            // There and back again.
            let mut back = resolution.clone();
            back.set_uniform(&forest, before.shown());
            prop_assert_eq!(back, before);
        }
    }

    #[test]
    fn clusters_go_their_own_ways_and_come_back_to_one_level((leaves, collapses) in any_forest(), ways in proptest::collection::vec(0usize..9, 40), then in 0usize..50) {
        let forest = Forest::new(leaves, &collapses);
        let mut resolution = Resolution::finest(&forest);
        resolution.set_variable(&forest, |g| ways[g as usize]);
        let expected: usize = (0..forest.clusters() as u32).map(|g| forest.size(g) - ways[g as usize].min(forest.size(g) - 1)).sum();
        prop_assert_eq!(resolution.shown(), expected);
        for g in 0..forest.clusters() as u32 {
            prop_assert_eq!(forest.shown(g, resolution.collapsed(g)).count(), resolution.active_leaves(&forest, g));
            prop_assert!(resolution.active_leaves(&forest, g) >= 1, "every level covers every cluster");
        }
        resolution.set_uniform(&forest, then);
        let mut straight = Resolution::finest(&forest);
        straight.set_uniform(&forest, then);
        prop_assert_eq!(resolution, straight);
    }
}
