//! A look's judgement: logistic regression on a pixel's numbers and their squares. Of what was tried on unseen photographs (networks,
//! random forests), nothing with more weights did better.

use rayon::prelude::*;

/// One input of a [`Look`]: its mean and inverse deviation over the training pixels, and the weights of the standardised value and of
/// its square.
pub type Term = [f32; 4];

/// Standardised values beyond this many deviations count as this many.
const OUTLIER: f32 = 3.0;

/// A learned judgement.
#[derive(Debug, Clone, Copy)]
pub struct Look<'a> {
    /// One term per input.
    pub terms: &'a [Term],
    /// Log-odds of an average pixel.
    pub bias: f32,
}

impl Look<'_> {
    /// The log-odds of each row of inputs.
    pub fn judge(&self, rows: &[f32]) -> Vec<f32> {
        rows.par_chunks_exact(self.terms.len().max(1)).map(|row| self.logit(row)).collect()
    }

    fn logit(&self, row: &[f32]) -> f32 {
        let term = |(v, [mean, scale, linear, square]): (&f32, &Term)| {
            let z = ((v - mean) * scale).clamp(-OUTLIER, OUTLIER);
            linear * z + square * z * z
        };
        self.bias + row.iter().zip(self.terms).map(term).sum::<f32>()
    }
}
