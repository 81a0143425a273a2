//! The recommended chain as trees that can be drawn: the stand-ins of a [`Chain`], each seen only at its own distances, joined into one tree
//! with levels of detail, and each by itself.

use crate::Result;
use crate::repr::file::{self, Origin};
use crate::repr::{BuiltPart, BuiltTree, Level, Seen};

use super::answer::{Chain, Link};
use super::contender::{Contender, Workshop};

/// A share of the distance at which one link takes over from another in which both are seen: what comes is there before what goes begins to
/// go.
const FADE: f32 = 0.1;

/// The stand-ins of a chain, each as if it stood alone: one level where one was told, all of its own else.
///
/// # Errors
/// [`Error::UnknownMethod`](crate::Error::UnknownMethod) for a link that is none of `contenders`; those of [`Contender::build`].
pub fn build(chain: &Chain, contenders: &[Contender], shop: &Workshop) -> Result<Vec<BuiltTree>> {
    let of = |link: &Link| {
        let known = || contenders.iter().map(|of| of.id().to_owned()).collect::<Vec<_>>().join(", ");
        let contender = contenders.iter().find(|of| of.id() == link.method);
        let contender = contender.ok_or_else(|| crate::Error::UnknownMethod { known: known(), found: link.method.clone() })?;
        let built = contender.build(shop)?.plain();
        let told = link.level.as_ref().and_then(|name| built.levels.iter().position(|level| level.name == *name));
        Ok(match told {
            Some(number) => file::one_level(built, number),
            None => built,
        })
    };
    chain.links.iter().map(of).collect()
}

/// Where a comparison's trees in files say that they come from.
pub fn origin(chain: &Chain, shop: &Workshop) -> Origin {
    let link = |(i, link): (usize, &Link)| {
        let level = link.level.as_ref().map_or_else(String::new, |level| format!(", level {level}"));
        (format!("link_{i}"), format!("{}{level} from {} tree heights on", link.method, link.from_distance))
    };
    let parameters = chain.links.iter().enumerate().map(link).collect();
    Origin { source: shop.source.name().to_owned(), trunk: None, parameters, seed: shop.seed }
}

/// One tree of the links' trees, each seen at its own distances.
///
/// # Errors
/// [`Error::NoChain`](crate::Error::NoChain) where there is no link.
pub fn join(chain: &Chain, built: &[BuiltTree], max_flip: f64) -> Result<BuiltTree> {
    let until = |i: usize| chain.links.get(i + 1).map_or(f32::MAX, |next| next.from_distance);
    let bounded =
        chain.links.iter().zip(built).enumerate().map(|(i, (link, tree))| bounded(tree.clone(), [link.from_distance, until(i)]));
    let joined = bounded.reduce(|mut all, next| {
        all.parts.extend(next.parts);
        all.levels.extend(next.levels);
        all.growth = all.growth.or(next.growth);
        all.build_ms += next.build_ms;
        all
    });
    let joined = joined.ok_or(crate::Error::NoChain { max_flip })?;
    Ok(BuiltTree { method: "chain".to_owned(), ..joined })
}

/// A tree that is seen only from one distance to another.
fn bounded(tree: BuiltTree, [from, until]: [f32; 2]) -> BuiltTree {
    let middle = tree.bounds.center();
    let band = Seen::between(middle, from, until, FADE);
    let part = |part: BuiltPart| {
        let own = part.seen;
        let comes_later = band.appears[1] > own.appears[1];
        let goes_sooner = band.vanishes[0] < own.vanishes[0];
        let appears = if comes_later { band.appears } else { own.appears };
        let vanishes = if goes_sooner { band.vanishes } else { own.vanishes };
        // The chain's distances are from the middle of the tree; so that parts of one tree come and go together.
        let anchor = if comes_later { middle } else { own.anchor };
        let vanish_anchor = if goes_sooner { Some(middle) } else { Some(own.vanish_anchor.unwrap_or(own.anchor)) };
        let vanish_anchor = vanish_anchor.filter(|vanish| *vanish != anchor);
        // What is never seen within the band is not of it.
        (appears[0] < vanishes[1])
            .then(|| part.seen(Seen { anchor, vanish_anchor, appears, vanishes: later(vanishes, appears), ..own }))
    };
    let parts: Vec<BuiltPart> = tree.parts.into_iter().filter_map(part).collect();
    let within = |level: &Level| level.distance > from && level.distance < until / (1.0 + FADE);
    let name = |level: &str| if tree.levels.len() > 1 { format!("{} {level}", tree.method) } else { tree.method.clone() };
    let mut levels: Vec<Level> =
        tree.levels.iter().filter(|level| within(level)).map(|level| Level { name: name(&level.name), ..level.clone() }).collect();
    if levels.is_empty() {
        // Somewhere between; beyond the last switch, twice as far.
        let distance = if until == f32::MAX { 2.0 * from.max(0.5) } else { (from.max(0.25 * until) * until).sqrt() };
        levels.push(Level { name: tree.method.clone(), distance });
    }
    BuiltTree { parts, levels, ..tree }
}

/// `vanishes`, but not before `appears` has come to its end.
fn later(vanishes: [f32; 2], appears: [f32; 2]) -> [f32; 2] {
    let begin = vanishes[0].max(appears[1]);
    [begin, vanishes[1].max(begin)]
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geom::Bounds;
    use crate::model::Part;

    fn tree(method: &str, ends: &[f32]) -> BuiltTree {
        let part = Part { name: String::new(), surface: Default::default(), material: Default::default(), crown_center: None };
        let seen = ends.windows(2).map(|ends| Seen::between(Vec3::Y, ends[0], ends[1], 0.1));
        let parts = seen.map(|seen| BuiltPart::still(part.clone()).seen(seen)).collect();
        let level = |ends: &[f32]| Level { name: format!("{}", ends[0]), distance: (ends[0].max(0.5) * ends[1].min(1e3)).sqrt() };
        let levels = ends.windows(2).map(level).collect();
        BuiltTree { method: method.to_owned(), levels, ..BuiltTree::new(Bounds { min: -Vec3::ONE, max: Vec3::ONE }, parts) }
    }

    fn chain(links: &[(&str, f32)]) -> Chain {
        let link = |&(method, from_distance): &(&str, f32)| Link {
            method: method.to_owned(),
            level: None,
            from_height_px: None,
            from_distance,
        };
        Chain { links: links.iter().map(link).collect() }
    }

    #[test]
    fn at_every_distance_one_link_is_all_there_and_far_from_switches_no_other() {
        let built =
            [tree("fine", &[0.0, 4.0, 12.0, f32::MAX]), tree("plain", &[0.0, f32::MAX]), tree("coarse", &[0.0, 30.0, f32::MAX])];
        let joined = join(&chain(&[("fine", 0.0), ("plain", 8.0), ("coarse", 20.0)]), &built, 0.1).unwrap();
        let shares = |d: f32| joined.parts.iter().map(|part| part.seen.share_at(d)).collect::<Vec<_>>();
        for i in 1..2000 {
            let d = 0.05 * i as f32;
            assert!(shares(d).contains(&1.0), "nothing at {d}: {:?}", shares(d));
        }
        // fine 0–4, fine 4–8 (its third is never seen), plain, coarse to 30, coarse beyond.
        assert_eq!(joined.parts.len(), 5);
        for (d, which) in [(2.0, 0), (6.0, 1), (14.0, 2), (25.0, 3), (90.0, 4)] {
            let expected: Vec<f32> = (0..5).map(|i| f32::from(u8::from(i == which))).collect();
            assert_eq!(shares(d), expected, "at {d}");
        }
        let names: Vec<&str> = joined.levels.iter().map(|level| level.name.as_str()).collect();
        assert_eq!(names[0], "fine 0");
        assert!(joined.levels.iter().map(|level| level.distance).is_sorted());
        for level in &joined.levels {
            let seen = shares(level.distance);
            assert!(
                seen.iter().filter(|share| **share == 1.0).count() == 1 && seen.iter().sum::<f32>() == 1.0,
                "{level:?} {seen:?}"
            );
        }
    }

    #[test]
    fn a_chain_of_nothing_is_refused() {
        assert!(matches!(join(&Chain::default(), &[], 0.05), Err(crate::Error::NoChain { .. })));
    }
}
