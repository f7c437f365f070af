//! The random states that every contestant gets.

/// Position, speed and acceleration of the six joints.
pub struct State {
    pub q: [f64; 6],
    pub qd: [f64; 6],
    pub qdd: [f64; 6],
}

/// Few enough to stay in the second-level cache, many enough to defeat prediction of the numbers.
pub const N_STATES: usize = 1024;

/// States in [−π, π] rad, [−2, 2] rad/s, [−4, 4] rad/s², from a fixed seed.
pub fn states() -> Vec<State> {
    let mut uniform = Uniform(0x5EED_0F0A);
    let mut row = |range: f64| std::array::from_fn(|_| range * uniform.next());
    (0..N_STATES)
        .map(|_| State {
            q: row(std::f64::consts::PI),
            qd: row(2.0),
            qdd: row(4.0),
        })
        .collect()
}

/// SplitMix64 (Steele, Lea & Flood 2014), mapped to [−1, 1).
struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}
