//! A small two-layer network: one hidden layer of rectifiers, one logit.

use rayon::prelude::*;

/// The mean log-odds of several networks of one shape, for each row of `inputs` numbers; their weights follow one another.
pub fn committee(inputs: usize, hidden: usize, weights: &[f32], rows: &[f32]) -> Vec<f32> {
    let size = Network::size(inputs, hidden);
    let members = (weights.len() / size) as f32;
    let vote = |row: &[f32]| {
        weights.chunks_exact(size).map(|weights| Network { inputs, hidden, weights }.logit(row)).sum::<f32>() / members
    };
    rows.par_chunks_exact(inputs).map(vote).collect()
}

/// Weights of a network with `hidden` units over `inputs` numbers, in one row: per unit its input weights and bias, then the output
/// weights and bias.
#[derive(Debug, Clone, Copy)]
pub struct Network<'a> {
    /// Numbers per sample.
    pub inputs: usize,
    /// Hidden units.
    pub hidden: usize,
    /// The weights.
    pub weights: &'a [f32],
}

impl Network<'_> {
    /// Numbers a network of this shape has.
    pub const fn size(inputs: usize, hidden: usize) -> usize {
        hidden * (inputs + 2) + 1
    }

    /// The log-odds for one sample.
    pub fn logit(&self, sample: &[f32]) -> f32 {
        let (units, output) = self.weights.split_at(self.hidden * (self.inputs + 1));
        let activations = units.chunks_exact(self.inputs + 1).map(|unit| {
            let (bias, weights) = (unit[self.inputs], &unit[..self.inputs]);
            (weights.iter().zip(sample).map(|(w, v)| w * v).sum::<f32>() + bias).max(0.0)
        });
        activations.zip(output).map(|(a, w)| a * w).sum::<f32>() + output[self.hidden]
    }
}
