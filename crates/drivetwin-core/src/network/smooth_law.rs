// SPDX-License-Identifier: MIT
//! The laws of smooth channels and of normal loads in one form, as the inner loop over samples evaluates
//! them.

use super::branch::Branch;
use super::nonlinear_torque::{NonlinearTorque, TorqueLaw};
use crate::model::FrictionLaw;
use crate::model::mechanism::Normal;
use crate::number::{Coefficient, KernelFloat, Number};

/// Most inputs of a network that is marched.
pub const MAX_INPUTS: usize = 16;

/// Value at the start of a sample and rate within it, of every input.
pub type Sample<U> = [[U; 2]];

/// `gain · u + offset`.
#[derive(Clone, Copy, Debug)]
pub struct AffineForm<L> {
    /// Index of the input.
    pub input: usize,
    /// Over the input.
    pub gain: L,
    /// At zero.
    pub offset: L,
}

/// `τ = N(u) · μ(m)`, `μ(m) = c0 + c1 m + c2 m² + excess · e^-m` over `m = sign · unit · s` between `from`
/// and `to`: a friction torque over the slip, counted in Stribeck speeds, or `c2 · s|s|` with N = 1. The
/// channel is `φ = sign · τ`.
#[derive(Clone, Copy, Debug)]
pub struct SmoothLaw<L> {
    /// Direction of motion.
    pub sign: L,
    /// Argument per slip, s/rad.
    pub unit: L,
    /// N over its input.
    pub normal: AffineForm<L>,
    /// Coefficients of μ, the highest last.
    pub polynomial: [L; 3],
    /// Stiction above the polynomial at rest.
    pub excess: L,
    /// Least `m` of this branch.
    pub from: L,
    /// Largest `m` of this branch.
    pub to: L,
}

/// A channel at one instant with its partial derivatives.
#[derive(Clone, Copy, Debug)]
pub struct LawValue<L> {
    /// τ.
    pub value: L,
    /// τ_m.
    pub by_argument: L,
    /// τ_mm / 2.
    pub half_second_derivative: L,
    /// τ_N.
    pub by_normal: L,
    /// τ_mN.
    pub mixed: L,
}

/// Unit of an argument without stiction: nothing is far in it.
const COARSE: f64 = 1.0 / 1024.0;

impl<L: KernelFloat> SmoothLaw<L> {
    /// No torque, whatever the argument.
    pub fn idle() -> Self {
        let zero = L::splat(0.0);
        Self {
            sign: L::splat(1.0),
            unit: L::splat(COARSE),
            normal: AffineForm { input: 0, gain: zero, offset: zero },
            polynomial: [zero; 3],
            excess: zero,
            from: L::splat(f64::NEG_INFINITY),
            to: L::splat(f64::INFINITY),
        }
    }
}

impl<T: Number> SmoothLaw<T> {
    /// The law of a channel in its present branch; `None` where it is not smooth over one argument.
    pub fn from_channel(channel: &NonlinearTorque<T>, branch: Branch) -> Option<Self> {
        let Branch::Moving { sign, piece } = branch else { return None };
        let (zero, one) = (T::zero_(), T::of(1.0));
        let normal = AffineForm { input: 0, gain: zero, offset: one };
        let plain = Self { sign: T::of(sign), normal, from: zero, ..Self::idle() };
        match &channel.law {
            TorqueLaw::Quadratic(coefficient) => {
                Some(Self { polynomial: [zero, zero, *coefficient * COARSE.powi(-2)], ..plain })
            }
            TorqueLaw::Friction { mu, normal, .. } => {
                let plain = Self { normal: normal_load(normal), ..plain };
                Some(match mu {
                    FrictionLaw::Stribeck(law) => Self {
                        unit: law.v_s.recip(),
                        polynomial: [law.mu_c, law.mu_v * law.v_s, zero],
                        excess: law.mu_s - law.mu_c,
                        ..plain
                    },
                    FrictionLaw::Table(table) => {
                        let (piece, (from, to)) = table.piece(piece);
                        let level = piece.value - piece.slope * piece.from;
                        let polynomial = [level, piece.slope * COARSE.recip(), zero];
                        let [from, to] = [from, to].map(|end| T::of(end * COARSE));
                        Self { polynomial, from, to, ..plain }
                    }
                })
            }
            _ => None,
        }
    }
}

/// The normal load over its input.
pub fn normal_load<T: Number>(normal: &Normal<T>) -> AffineForm<T> {
    match *normal {
        Normal::Pressure { input, gain, p0 } => AffineForm { input, gain, offset: -(gain * p0) },
        Normal::Constant(normal) => AffineForm { input: 0, gain: T::zero_(), offset: normal },
    }
}

impl<L: KernelFloat> SmoothLaw<L> {
    /// Contribution of stiction to μ.
    #[inline(always)]
    pub fn stiction<const F: bool>(&self, m: L) -> L {
        self.excess * (-m).exponential::<F>()
    }

    /// μ and its derivatives at argument `m`.
    #[inline(always)]
    pub fn expand_at<const F: bool>(&self, m: L, stiction: L) -> FrictionExpansion<L> {
        let [c0, c1, c2] = self.polynomial;
        let line = c2.fma::<F>(m, c1);
        FrictionExpansion {
            mu: line.fma::<F>(m, c0) + stiction,
            slope: c2.fma::<F>(m, line) - stiction,
            half_second_derivative: stiction.fma_times::<F>(0.5, c2),
            cubic: stiction.times(-1.0 / 6.0),
        }
    }
}

/// μ about one argument: its Taylor coefficients.
#[derive(Clone, Copy, Debug)]
pub struct FrictionExpansion<L> {
    mu: L,
    slope: L,
    half_second_derivative: L,
    cubic: L,
}

impl<L: KernelFloat> FrictionExpansion<L> {
    /// The torque where the argument is larger by a small `dm`, at normal load `normal`.
    #[inline(always)]
    pub fn value_at<const F: bool>(&self, dm: L, normal: L) -> LawValue<L> {
        // Low and high powers apart, for a shorter chain of dependent products.
        let (low, high) = (
            self.slope.fma::<F>(dm, self.mu),
            self.cubic.fma::<F>(dm, self.half_second_derivative),
        );
        let mu = high.fma::<F>(dm * dm, low);
        let (twice, thrice) =
            (self.half_second_derivative + self.half_second_derivative, self.cubic.times(3.0));
        let slope = thrice.fma::<F>(dm, twice).fma::<F>(dm, self.slope);
        LawValue {
            value: normal * mu,
            by_argument: normal * slope,
            half_second_derivative: normal * thrice.fma::<F>(dm, self.half_second_derivative),
            by_normal: mu,
            mixed: slope,
        }
    }

    /// The torque at the argument itself.
    #[inline(always)]
    pub fn value_at_center(&self, normal: L) -> LawValue<L> {
        LawValue {
            value: normal * self.mu,
            by_argument: normal * self.slope,
            half_second_derivative: normal * self.half_second_derivative,
            by_normal: self.mu,
            mixed: self.slope,
        }
    }
}

impl<L: KernelFloat> LawValue<L> {
    /// Nothing.
    #[inline(always)]
    pub fn zero() -> Self {
        let zero = L::splat(0.0);
        Self {
            value: zero,
            by_argument: zero,
            half_second_derivative: zero,
            by_normal: zero,
            mixed: zero,
        }
    }

    /// Value and slopes where the argument is larger by a `ds` of which the square is nothing.
    #[inline(always)]
    pub fn shifted<const F: bool>(&self, ds: L) -> Self {
        Self {
            value: self.by_argument.fma::<F>(ds, self.value),
            by_argument: self.half_second_derivative.fma::<F>(ds + ds, self.by_argument),
            by_normal: self.mixed.fma::<F>(ds, self.by_normal),
            ..*self
        }
    }
}

impl<L: KernelFloat> AffineForm<L> {
    /// Value at the start of a sample.
    #[inline(always)]
    pub fn start<const F: bool, U: Coefficient<L>>(&self, sample: &Sample<U>) -> L {
        sample[self.input][0].multiply_add::<F>(self.gain, self.offset)
    }
}

impl<L: Copy> AffineForm<L> {
    /// Convert the coefficients to another number type.
    #[inline(always)]
    pub fn map<M>(&self, f: impl Fn(L) -> M) -> AffineForm<M> {
        AffineForm { input: self.input, gain: f(self.gain), offset: f(self.offset) }
    }
}
