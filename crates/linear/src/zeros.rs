//! Zeros of one channel: the motions that an output does not see.

use faer::{Mat, c64};

use crate::LinearError;
use crate::poles::{Poles, balance};

/// The zeros of a channel and its gain.
///
/// ```text
/// G(s) = c (s − A)⁻¹ b + d = k Π(s − z)/Π(s − p)
/// ```
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Zeros {
    pub zeros: Vec<c64>,
    pub gain: f64,
}

// What is smaller than this, against what it is added to, is rounding.
const ROUNDING: f64 = 1e-12;

/// The zeros of a channel, rad/s, in the order of their size; no zeros and no gain if the input does not reach the
/// output at all.
///
/// Each step holds the output at zero: one state less, and what drove it is the new output (Emami-Naeini and Van
/// Dooren, *Computation of zeros of linear multivariable systems*, Automatica 18(4), 1982). Infinite zeros never
/// enter, so none has to be told from a finite one.
///
/// ```text
/// y = γ xₙ = 0  ⇒  ẋₙ = a₁ x₁ + bₙ u = 0;    with bₙ ≠ 0:  zeros = eigenvalues of A₁ − b₁ a₁/bₙ
/// ```
///
/// # Errors
/// If the eigenvalues do not check.
pub(crate) fn zeros(A: &Mat<f64>, b: &[f64], c: &[f64], d: f64) -> Result<Zeros, LinearError> {
    let scale = balance(A);
    let n = A.nrows();
    let mut A = Mat::from_fn(n, n, |i, j| A[(i, j)] * scale[j] / scale[i]);
    let mut b: Vec<f64> = (0..n).map(|i| b[i] / scale[i]).collect();
    let mut c: Vec<f64> = (0..n).map(|j| c[j] * scale[j]).collect();
    let (mut d, mut gain, size) = (d, 1.0, A.norm_l2());
    // The natural size of the channel: an output of size ‖c‖ whose states move at the rate ‖b‖ for a time 1/‖A‖.
    let mut seen = norm(&c) * norm(&b) / size;
    loop {
        let n = A.nrows();
        if d.abs() > ROUNDING * seen {
            let inner = Mat::from_fn(n, n, |i, j| A[(i, j)] - b[i] * c[j] / d);
            return Ok(Zeros { zeros: Poles::of(&inner)?.values, gain: gain * d });
        }
        let length = norm(&c);
        if n == 0 || length <= ROUNDING * size || norm(&b) == 0.0 {
            return Ok(Zeros { zeros: Vec::new(), gain: 0.0 });
        }
        // The output is the last state.
        let v = reflector(&c);
        reflect(&mut A, &mut b, &v);
        gain *= length;
        d = b[n - 1];
        c = (0..n - 1).map(|j| A[(n - 1, j)]).collect();
        seen = norm(&b);
        b.truncate(n - 1);
        A = A.submatrix(0, 0, n - 1, n - 1).to_owned();
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

// The unit vector v of H = 1 − 2 v vᵀ with c H = ‖c‖ eₙ; zero where c is that already.
fn reflector(c: &[f64]) -> Vec<f64> {
    let (last, length) = (c.len() - 1, norm(c));
    let rest: f64 = c[..last].iter().map(|x| x * x).sum();
    let mut v = c.to_vec();
    // cₙ − ‖c‖ without cancellation
    v[last] = if c[last] > 0.0 { -rest / (c[last] + length) } else { c[last] - length };
    let size = norm(&v);
    if size == 0.0 {
        return v;
    }
    v.iter().map(|x| x / size).collect()
}

// A ← H A H,   b ← H b
fn reflect(A: &mut Mat<f64>, b: &mut [f64], v: &[f64]) {
    let n = v.len();
    let along: f64 = v.iter().zip(b.iter()).map(|(v, b)| v * b).sum();
    b.iter_mut().zip(v).for_each(|(b, v)| *b -= 2.0 * v * along);
    for j in 0..n {
        let along: f64 = (0..n).map(|i| v[i] * A[(i, j)]).sum();
        (0..n).for_each(|i| A[(i, j)] -= 2.0 * v[i] * along);
    }
    for i in 0..n {
        let along: f64 = (0..n).map(|j| A[(i, j)] * v[j]).sum();
        (0..n).for_each(|j| A[(i, j)] -= 2.0 * along * v[j]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // (s² + 2s + 9)/((s + 1)(s + 2)(s + 3)) in controllable form.
    #[test]
    fn zeros_of_a_rational_function_are_its_numerators() {
        let A = Mat::from_fn(3, 3, |i, j| match (i, j) {
            (0, 1) | (1, 2) => 1.0,
            (2, j) => [-6.0, -11.0, -6.0][j],
            _ => 0.0,
        });
        let found = zeros(&A, &[0.0, 0.0, 1.0], &[9.0, 2.0, 1.0], 0.0).unwrap();
        assert!((found.gain - 1.0).abs() < 1e-13);
        let exact = c64::new(-1.0, 8f64.sqrt());
        assert!(found.zeros.iter().all(|z| (c64::new(z.re, z.im.abs()) - exact).norm() < 1e-12), "{found:?}");
        // The same with feedthrough 2 has three: 2 (s³ + 6s² + 11s + 6) + s² + 2s + 9.
        let found = zeros(&A, &[0.0, 0.0, 1.0], &[9.0, 2.0, 1.0], 2.0).unwrap();
        assert_eq!((found.zeros.len(), found.gain), (3, 2.0));
        for z in found.zeros {
            let value = ((z * 2.0 + 13.0) * z + 24.0) * z + 21.0;
            assert!(value.norm() < 1e-11, "{z}");
        }
    }

    #[test]
    fn an_output_that_the_input_does_not_reach_has_no_gain() {
        let A = Mat::from_fn(2, 2, |i, j| if i == j { -1.0 - i as f64 } else { 0.0 });
        let found = zeros(&A, &[1.0, 0.0], &[0.0, 1.0], 0.0).unwrap();
        assert_eq!((found.zeros.len(), found.gain), (0, 0.0));
    }
}
