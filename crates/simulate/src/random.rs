//! Random numbers that depend on nothing but the seed, what they are for, and their place in the row.

use core::f64::consts::TAU;

/// A row of random numbers with a name. The k-th number is computed from k alone, so neither the order in which
/// joints are asked nor the number of joints changes it.
///
/// # Example
/// ```
/// use sinew_simulate::Stream;
/// let noise = Stream::new(7, "motor_position.elbow");
/// assert_eq!(noise.normal(3), Stream::new(7, "motor_position.elbow").normal(3));
/// assert_ne!(noise.normal(3), Stream::new(8, "motor_position.elbow").normal(3));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stream {
    key: u64,
}

impl Stream {
    /// The row called `name` of this seed.
    pub fn new(seed: u64, name: &str) -> Self {
        // Fowler, Noll and Vo's hash of the name.
        let hash = name
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
        Self { key: mix(mix(seed) ^ hash) }
    }

    /// The k-th number, evenly spread over (0, 1).
    pub fn uniform(&self, k: u64) -> f64 {
        // 53 bits and a half, so that neither 0 nor 1 comes out.
        ((mix(self.key ^ mix(k)) >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    /// The k-th number, normal with mean 0 and standard deviation 1 (Box and Muller).
    ///
    /// ```text
    /// x = √(−2 ln u₁) · cos 2πu₂
    /// ```
    pub fn normal(&self, k: u64) -> f64 {
        let (radius, turn) = (self.uniform(2 * k), self.uniform(2 * k + 1));
        (-2.0 * radius.ln()).sqrt() * (TAU * turn).cos()
    }
}

// The output function of SplitMix64 (Steele, Lea, Flood 2014).
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: u64 = 100_000;

    #[test]
    fn normal_numbers_have_mean_zero_variance_one_and_kurtosis_three() {
        let stream = Stream::new(1, "test");
        let moment = |power: i32| (0..N).map(|k| stream.normal(k).powi(power)).sum::<f64>() / N as f64;
        // Five standard deviations of each mean.
        assert!(moment(1).abs() < 5.0 / (N as f64).sqrt());
        assert!((moment(2) - 1.0).abs() < 5.0 * (2.0 / N as f64).sqrt());
        assert!((moment(4) - 3.0).abs() < 5.0 * (96.0 / N as f64).sqrt());
    }

    #[test]
    fn neighbours_and_names_are_independent() {
        let (a, b) = (Stream::new(1, "motor_position.j1"), Stream::new(1, "motor_position.j2"));
        let product = |f: &dyn Fn(u64) -> f64| (0..N).map(f).sum::<f64>() / (N as f64).sqrt();
        assert!(product(&|k| a.normal(k) * a.normal(k + 1)).abs() < 5.0);
        assert!(product(&|k| a.normal(k) * b.normal(k)).abs() < 5.0);
    }
}
