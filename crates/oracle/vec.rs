//! Three f64 numbers: a point, a direction or a colour.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A point, a direction, or (as [`Rgb`]) a colour.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Vec3 {
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

/// A linear colour; products are per channel.
pub(crate) type Rgb = Vec3;

impl Vec3 {
    pub const ZERO: Self = Self::splat(0.0);
    pub const ONE: Self = Self::splat(1.0);

    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self { x, y, z }
    }

    pub const fn splat(value: f64) -> Self {
        Self::new(value, value, value)
    }

    pub fn to_array(self) -> [f64; 3] {
        [self.x, self.y, self.z]
    }

    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self::new(f(self.x), f(self.y), f(self.z))
    }

    pub fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self::new(f(self.x, other.x), f(self.y, other.y), f(self.z, other.z))
    }

    pub fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    pub fn length(self) -> f64 {
        self.dot(self).sqrt()
    }

    /// Unit length; not a number for the zero vector.
    pub fn normalized(self) -> Self {
        self * (1.0 / self.length())
    }

    /// Unit length, or `None` if what is left is no more than the rounding of f32 data.
    pub fn try_normalized(self) -> Option<Self> {
        const VANISHING: f64 = 1e-6;
        (self.length() > VANISHING).then(|| self.normalized())
    }

    pub fn min(self, other: Self) -> Self {
        self.zip(other, f64::min)
    }

    pub fn max(self, other: Self) -> Self {
        self.zip(other, f64::max)
    }

    /// The largest component; `max(colour)` in `shaders/README.md`.
    pub fn largest(self) -> f64 {
        self.x.max(self.y).max(self.z)
    }

    pub fn is_zero(self) -> bool {
        self == Self::ZERO
    }
}

impl From<[f64; 3]> for Vec3 {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

impl From<[f32; 3]> for Vec3 {
    fn from(xyz: [f32; 3]) -> Self {
        xyz.map(f64::from).into()
    }
}

impl Add for Vec3 {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl AddAssign for Vec3 {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Vec3 {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Neg for Vec3 {
    type Output = Self;
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl Mul for Vec3 {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl Mul<f64> for Vec3 {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self.map(|a| a * factor)
    }
}

impl Mul<Vec3> for f64 {
    type Output = Vec3;
    fn mul(self, vector: Vec3) -> Vec3 {
        vector * self
    }
}
