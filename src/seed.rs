//! Random numbers that are keyed, never streamed.
//!
//! A draw is a pure function of (seed, stage, item, draw number), so it does not depend on which thread asks, in which order, or on
//! how many draws another item made. Mixing is SplitMix64's finaliser (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number
//! generators", fig. 15), applied to each key in turn.

/// The user's seed: same input, same seed, same version ⇒ the same bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Seed(pub u64);

impl Seed {
    /// The random numbers of one `item` (a point, a polygon, …) of one `stage` (a unique name).
    pub fn keyed(self, stage: &str, item: u64) -> Draws {
        let stage = stage.bytes().fold(0xcbf2_9ce4_8422_2325, |h, b| mix(h ^ u64::from(b)));
        Draws { state: mix(mix(self.0 ^ stage).wrapping_add(mix(item ^ GOLDEN))) }
    }
}

/// The numbers that belong to one key; drawing advances only this value.
#[derive(Debug, Clone)]
pub struct Draws {
    state: u64,
}

impl Draws {
    /// 64 uniform bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN);
        mix(self.state)
    }

    /// Uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in `[-1, 1)`.
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Uniform in `0..n`; 0 when `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_depend_on_every_part_of_the_key_and_on_nothing_else() {
        let first = |seed, stage, item| Seed(seed).keyed(stage, item).bits();
        assert_eq!(first(1, "disturb", 7), first(1, "disturb", 7));
        assert_ne!(first(1, "disturb", 7), first(2, "disturb", 7));
        assert_ne!(first(1, "disturb", 7), first(1, "texture", 7));
        assert_ne!(first(1, "disturb", 7), first(1, "disturb", 8));
    }

    #[test]
    fn unit_draws_of_many_items_are_uniform() {
        let n = 10_000;
        let mut bins = [0usize; 10];
        for item in 0..n {
            bins[(Seed(3).keyed("bins", item).unit() * 10.0) as usize] += 1;
        }
        // Six standard deviations of a binomial with n = 10,000 and p = 0.1.
        assert!(bins.iter().all(|&b| b.abs_diff(1000) < 180), "{bins:?}");
    }
}
