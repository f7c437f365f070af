//! A low-pass filter that moves nothing in time: Butterworth of order 4, forwards and backwards.

use std::f64::consts::PI;

use crate::error::LogError;

/// Order of the filter; of the two runs together it is twice that.
const ORDER: usize = 4;
/// Rows by which both ends are extended: three times the number of coefficients.
const EXTENSION: usize = 3 * (ORDER + 1);

/// A Butterworth low-pass of order 4, by bilinear transform with pre-warping.
///
/// ```text
/// f = 2 tan(π ω/2),   p_k = f exp(iπ(2k + 5)/8),   z_k = (2 + p_k)/(2 − p_k),   k = 0…3
/// a(z) = Π (z − z_k),   b(z) = f⁴/Π(2 − p_k) (1 + z)⁴
/// ```
/// with ω the cut-off as a part of the Nyquist frequency.
/// # Source
/// Oppenheim & Schafer, "Discrete-Time Signal Processing", sec. 7.1.
#[derive(Debug, Clone, PartialEq)]
pub struct LowPass {
    b: [f64; ORDER + 1],
    a: [f64; ORDER + 1],
    /// States at which a constant of one stays as it is.
    at_rest: [f64; ORDER],
}

impl LowPass {
    /// The filter of a cut-off frequency at a rate, both in Hz.
    ///
    /// # Errors
    /// [`LogError::CutOff`] where the cut-off is not between zero and half the rate.
    pub fn butterworth(cut_off: f64, rate: f64) -> Result<Self, LogError> {
        let part = 2.0 * cut_off / rate;
        if !(part > 0.0 && part < 1.0) {
            return Err(LogError::CutOff { cut_off, rate });
        }
        let f = 2.0 * (PI * part / 2.0).tan();
        // The poles are two conjugate pairs.
        let (first, second) = (Pair::new(f, 5.0), Pair::new(f, 7.0));
        let a = first.times(&second);
        let gain = f.powi(4) / (first.scale * second.scale);
        let b = [1.0, 4.0, 6.0, 4.0, 1.0].map(|binomial| gain * binomial);
        let mut at_rest = [0.0; ORDER];
        let mut state = 0.0;
        for k in (0..ORDER).rev() {
            state += b[k + 1] - a[k + 1];
            at_rest[k] = state;
        }
        Ok(Self { b, a, at_rest })
    }

    /// Coefficients (b, a), by falling powers of z.
    pub fn coefficients(&self) -> (&[f64], &[f64]) {
        (&self.b, &self.a)
    }

    /// Filters forwards and backwards, from ends that are extended by reflection through their last point.
    ///
    /// # Shapes
    /// `x` (n,), n > 15, evenly spaced in time; the result is as long.
    /// # Errors
    /// [`LogError::Short`].
    pub fn zero_phase(&self, x: &[f64]) -> Result<Vec<f64>, LogError> {
        let n = x.len();
        if n <= EXTENSION {
            return Err(LogError::Short {
                n_rows: n,
                needed: EXTENSION + 1,
            });
        }
        let (first, last) = (x[0], x[n - 1]);
        let mut y = Vec::with_capacity(n + 2 * EXTENSION);
        y.extend((1..=EXTENSION).rev().map(|k| 2.0 * first - x[k]));
        y.extend_from_slice(x);
        y.extend((1..=EXTENSION).map(|k| 2.0 * last - x[n - 1 - k]));
        self.run(&mut y);
        y.reverse();
        self.run(&mut y);
        y.reverse();
        y.truncate(n + EXTENSION);
        y.drain(..EXTENSION);
        Ok(y)
    }

    /// One run, in transposed direct form II, from rest at the first value.
    fn run(&self, x: &mut [f64]) {
        let (b, a) = (&self.b, &self.a);
        let mut s = self.at_rest.map(|state| state * x[0]);
        for x in x {
            let y = b[0] * *x + s[0];
            for k in 0..ORDER - 1 {
                s[k] = b[k + 1] * *x - a[k + 1] * y + s[k + 1];
            }
            s[ORDER - 1] = b[ORDER] * *x - a[ORDER] * y;
            *x = y;
        }
    }
}

/// A conjugate pair of poles as the quadratic z² + c₁ z + c₀.
struct Pair {
    c1: f64,
    c0: f64,
    /// |2 − p|².
    scale: f64,
}

impl Pair {
    fn new(f: f64, eighths: f64) -> Self {
        let real = f * (PI * eighths / 8.0).cos();
        let scale = 4.0 - 4.0 * real + f * f;
        Self {
            c1: -2.0 * (4.0 - f * f) / scale,
            c0: (4.0 + 4.0 * real + f * f) / scale,
            scale,
        }
    }

    fn times(&self, other: &Self) -> [f64; ORDER + 1] {
        [
            1.0,
            self.c1 + other.c1,
            self.c0 + self.c1 * other.c1 + other.c0,
            self.c1 * other.c0 + self.c0 * other.c1,
            self.c0 * other.c0,
        ]
    }
}

/// Derivative with respect to time: central differences, one-sided at the ends.
///
/// # Shapes
/// `x` (n,), n ≥ 2, every `step` seconds.
pub fn derivative(x: &[f64], step: f64) -> Vec<f64> {
    let n = x.len();
    let at = |row: usize| match row {
        0 => (x[1] - x[0]) / step,
        row if row == n - 1 => (x[row] - x[row - 1]) / step,
        row => (x[row + 1] - x[row - 1]) / (2.0 * step),
    };
    (0..n).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_and_a_slow_sine_stay_and_a_fast_one_goes() {
        let filter = LowPass::butterworth(10.0, 1000.0).unwrap();
        let line: Vec<f64> = (0..4000).map(|k| 3.0 - 0.01 * f64::from(k)).collect();
        let filtered = filter.zero_phase(&line).unwrap();
        // What the ends add falls by e in 42 ms, those of the slowest pole; what is left is rounding, of ε Σ|a|/Σa = 2e-10
        // of values up to 37.
        let off = (1500..2500).map(|k| (line[k] - filtered[k]).abs());
        assert!(off.fold(0.0, f64::max) < 1e-8);
        // Squared gain of two runs: 1/(1 + (tan(πf/r)/tan(πc/r))⁸).
        for hertz in [2.0, 10.0, 40.0_f64] {
            let wave = |k: usize| (2.0 * PI * hertz * k as f64 / 1000.0).sin();
            let filtered = filter
                .zero_phase(&(0..4000).map(wave).collect::<Vec<_>>())
                .unwrap();
            let ratio = (PI * hertz / 1000.0).tan() / (PI * 10.0 / 1000.0).tan();
            let gain = 1.0 / (1.0 + ratio.powi(8));
            let worst = (1000..3000).map(|k| (filtered[k] - gain * wave(k)).abs());
            assert!(worst.fold(0.0, f64::max) < 1e-6, "{hertz}");
        }
    }

    #[test]
    fn what_cannot_be_filtered_is_refused() {
        assert!(LowPass::butterworth(60.0, 100.0).is_err());
        assert!(LowPass::butterworth(f64::NAN, 100.0).is_err());
        let filter = LowPass::butterworth(10.0, 100.0).unwrap();
        assert!(filter.zero_phase(&[0.0; 15]).is_err());
        assert_eq!(filter.zero_phase(&[0.0; 16]).unwrap(), vec![0.0; 16]);
    }

    #[test]
    fn the_derivative_of_a_parabola_is_exact_inside() {
        let x: Vec<f64> = (0..5).map(|k| 0.25 * f64::from(k * k)).collect();
        assert_eq!(derivative(&x, 0.5), vec![0.5, 1.0, 2.0, 3.0, 3.5]);
    }
}
