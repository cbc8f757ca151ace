//! Measured spectra as colours: three channels of linear sRGB.
//!
//! A spectrum is integrated against the matching functions of the CIE's observer of 1931, and the result taken from XYZ to
//! sRGB. What is emitted is taken as it is, so equal power at all wavelengths is white point E; what is reflected is seen under
//! daylight, CIE illuminant D65, the white of sRGB, so that a white surface is white. Integrals are sums over 1000
//! wavelengths, with the normalisation of Mitsuba 3.9.1's RGB variants, so that a scene has the same colours in both.

use glam::{DMat3, DVec3};

/// What light a spectrum is seen in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Illuminant {
    /// None: the spectrum is that of light.
    Emitted,
    /// CIE illuminant D65: the spectrum is a factor of light.
    D65,
}

const FIRST: f64 = 360.0;
const LAST: f64 = 830.0;
const STEP: f64 = 5.0;
const STEPS: u32 = 1000;
/// Reciprocals of the integrals of ȳ, and of the mean of D65 weighted with it.
const Y_INTEGRAL: f64 = 106.750_259_399_414_06;
const D65_MEAN: f64 = 98.997_417_518_762_55;

/// Linear sRGB of a spectrum: wavelengths in nm, at least two, ascending, each with its value. Between them values are interpolated
/// linearly, beyond them they are 0. Saturated spectra have channels below 0 or above those of white.
pub fn to_rgb(samples: &[(f64, f64)], illuminant: Illuminant) -> DVec3 {
    integrate(illuminant, |wavelength| {
        let above = samples.partition_point(|(w, _)| *w <= wavelength);
        match (samples.get(above.wrapping_sub(1)), samples.get(above)) {
            (Some((w0, v0)), Some((w1, v1))) => v0 + (v1 - v0) * (wavelength - w0) / (w1 - w0),
            (Some((w0, v0)), None) if wavelength == *w0 => *v0,
            _ => 0.0,
        }
    })
}

/// Linear sRGB of the radiance of a black body, W/(m² sr nm): Planck's law with the constants of the SI of 2019. `temperature` is in
/// kelvins, > 0.
pub fn blackbody(temperature: f64) -> DVec3 {
    const H: f64 = 6.626_070_15e-34;
    const C: f64 = 299_792_458.0;
    const K: f64 = 1.380_649e-23;
    // The sum of a list has 1000 steps where there are 999 intervals, in Mitsuba as here; its spectral variants integrate.
    let exact = f64::from(STEPS) / f64::from(STEPS - 1);
    let planck = |wavelength: f64| {
        let metres = wavelength * 1e-9;
        2.0 * H * C * C / metres.powi(5) / (H * C / (metres * K * temperature)).exp_m1() * 1e-9
    };
    integrate(Illuminant::Emitted, planck) * exact
}

fn integrate(illuminant: Illuminant, value: impl Fn(f64) -> f64) -> DVec3 {
    let mut xyz = DVec3::ZERO;
    for k in 0..STEPS {
        let wavelength = FIRST + (LAST - FIRST) * f64::from(k) / f64::from(STEPS - 1);
        let at = (wavelength - FIRST) / STEP;
        let index = (at as usize).min(TABLE.len() - 2);
        let [a, b] = [TABLE[index], TABLE[index + 1]].map(|(x, y, z, d65)| (DVec3::new(x, y, z), d65));
        let t = at - index as f64;
        let light = match illuminant {
            Illuminant::Emitted => 1.0,
            Illuminant::D65 => (a.1 + (b.1 - a.1) * t) / D65_MEAN,
        };
        xyz += a.0.lerp(b.0, t) * (light * value(wavelength));
    }
    // ITU-R BT.709 primaries with white point D65.
    let to_srgb = DMat3::from_cols(
        DVec3::new(3.240479, -0.969256, 0.055648),
        DVec3::new(-1.537150, 1.875991, -0.204043),
        DVec3::new(-0.498535, 0.041556, 1.057311),
    );
    to_srgb * xyz * ((LAST - FIRST) / f64::from(STEPS) / Y_INTEGRAL)
}

/// x̄, ȳ and z̄ of the CIE's standard observer of 1931 (2°) and relative power of illuminant D65, from 360 nm to 830 nm in steps of
/// 5 nm: CIE 15:2004, "Colorimetry", tables T.4 and T.1.
#[rustfmt::skip]
const TABLE: [(f64, f64, f64, f64); 95] = [
    (1.299e-4, 3.917e-6, 6.061e-4, 46.6383),
    (2.321e-4, 6.965e-6, 0.001086, 49.3637),
    (4.149e-4, 1.239e-5, 0.001946, 52.0891),
    (7.416e-4, 2.202e-5, 0.003486, 51.0323),
    (0.001368, 3.9e-5, 0.006450001, 49.9755),
    (0.002236, 6.4e-5, 0.01054999, 52.3118),
    (0.004243, 1.2e-4, 0.02005001, 54.6482),
    (0.00765, 2.17e-4, 0.03621, 68.7015),
    (0.01431, 3.96e-4, 0.06785001, 82.7549),
    (0.02319, 6.4e-4, 0.1102, 87.1204),
    (0.04351, 0.00121, 0.2074, 91.486),
    (0.07763, 0.00218, 0.3713, 92.4589),
    (0.13438, 0.004, 0.6456, 93.4318),
    (0.21477, 0.0073, 1.03905, 90.057),
    (0.2839, 0.0116, 1.3856, 86.6823),
    (0.3285, 0.01684, 1.62296, 95.7736),
    (0.34828, 0.023, 1.74706, 104.865),
    (0.34806, 0.0298, 1.7826, 110.936),
    (0.3362, 0.038, 1.77211, 117.008),
    (0.3187, 0.048, 1.7441, 117.41),
    (0.2908, 0.06, 1.6692, 117.812),
    (0.2511, 0.0739, 1.5281, 116.336),
    (0.19536, 0.09098, 1.28764, 114.861),
    (0.1421, 0.1126, 1.0419, 115.392),
    (0.09564, 0.13902, 0.8129501, 115.923),
    (0.05795001, 0.1693, 0.6162, 112.367),
    (0.03201, 0.20802, 0.46518, 108.811),
    (0.0147, 0.2586, 0.3533, 109.082),
    (0.0049, 0.323, 0.272, 109.354),
    (0.0024, 0.4073, 0.2123, 108.578),
    (0.0093, 0.503, 0.1582, 107.802),
    (0.0291, 0.6082, 0.1117, 106.296),
    (0.06327, 0.71, 0.07824999, 104.79),
    (0.1096, 0.7932, 0.05725001, 106.239),
    (0.1655, 0.862, 0.04216, 107.689),
    (0.2257499, 0.9148501, 0.02984, 106.047),
    (0.2904, 0.954, 0.0203, 104.405),
    (0.3597, 0.9803, 0.0134, 104.225),
    (0.4334499, 0.9949501, 0.008749999, 104.046),
    (0.5120501, 1.0, 0.005749999, 102.023),
    (0.5945, 0.995, 0.0039, 100.0),
    (0.6784, 0.9786, 0.002749999, 98.1671),
    (0.7621, 0.952, 0.0021, 96.3342),
    (0.8425, 0.9154, 0.0018, 96.0611),
    (0.9163, 0.87, 0.001650001, 95.788),
    (0.9786, 0.8163, 0.0014, 92.2368),
    (1.0263, 0.757, 0.0011, 88.6856),
    (1.0567, 0.6949, 0.001, 89.3459),
    (1.0622, 0.631, 8.0e-4, 90.0062),
    (1.0456, 0.5668, 6.0e-4, 89.8026),
    (1.0026, 0.503, 3.4e-4, 89.5991),
    (0.9384, 0.4412, 2.4e-4, 88.6489),
    (0.8544499, 0.381, 1.9e-4, 87.6987),
    (0.7514, 0.321, 1.0e-4, 85.4936),
    (0.6424, 0.265, 4.999999e-5, 83.2886),
    (0.5419, 0.217, 3.0e-5, 83.4939),
    (0.4479, 0.175, 2.0e-5, 83.6992),
    (0.3608, 0.1382, 1.0e-5, 81.863),
    (0.2835, 0.107, 0.0, 80.0268),
    (0.2187, 0.0816, 0.0, 80.1207),
    (0.1649, 0.061, 0.0, 80.2146),
    (0.1212, 0.04458, 0.0, 81.2462),
    (0.0874, 0.032, 0.0, 82.2778),
    (0.0636, 0.0232, 0.0, 80.281),
    (0.04677, 0.017, 0.0, 78.2842),
    (0.0329, 0.01192, 0.0, 74.0027),
    (0.0227, 0.00821, 0.0, 69.7213),
    (0.01584, 0.005723, 0.0, 70.6652),
    (0.01135916, 0.004102, 0.0, 71.6091),
    (0.008110916, 0.002929, 0.0, 72.979),
    (0.005790346, 0.002091, 0.0, 74.349),
    (0.004109457, 0.001484, 0.0, 67.9765),
    (0.002899327, 0.001047, 0.0, 61.604),
    (0.00204919, 7.4e-4, 0.0, 65.7448),
    (0.001439971, 5.2e-4, 0.0, 69.8856),
    (9.999493e-4, 3.611e-4, 0.0, 72.4863),
    (6.900786e-4, 2.492e-4, 0.0, 75.087),
    (4.760213e-4, 1.719e-4, 0.0, 69.3398),
    (3.323011e-4, 1.2e-4, 0.0, 63.5927),
    (2.348261e-4, 8.48e-5, 0.0, 55.0054),
    (1.661505e-4, 6.0e-5, 0.0, 46.4182),
    (1.17413e-4, 4.24e-5, 0.0, 56.6118),
    (8.307527e-5, 3.0e-5, 0.0, 66.8054),
    (5.870652e-5, 2.12e-5, 0.0, 65.0941),
    (4.150994e-5, 1.499e-5, 0.0, 63.3828),
    (2.935326e-5, 1.06e-5, 0.0, 63.8434),
    (2.067383e-5, 7.4657e-6, 0.0, 64.304),
    (1.455977e-5, 5.2578e-6, 0.0, 61.8779),
    (1.025398e-5, 3.7029e-6, 0.0, 59.4519),
    (7.221456e-6, 2.6078e-6, 0.0, 55.7054),
    (5.085868e-6, 1.8366e-6, 0.0, 51.959),
    (3.581652e-6, 1.2934e-6, 0.0, 54.6998),
    (2.522525e-6, 9.1093e-7, 0.0, 57.4406),
    (1.776509e-6, 6.4153e-7, 0.0, 58.8765),
    (1.251141e-6, 4.5181e-7, 0.0, 60.3125),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_white() {
        // Equal power is point E: the sums of the rows of the matrix, to the digits that the tables have.
        let even = to_rgb(&[(300.0, 1.0), (900.0, 1.0)], Illuminant::Emitted);
        assert!(even.distance(DVec3::new(1.204_794, 0.948_291, 0.908_916)) < 5e-4, "{even}");
        let white = to_rgb(&[(300.0, 1.0), (900.0, 1.0)], Illuminant::D65);
        assert!(white.distance(DVec3::ONE) < 2.5e-3, "{white}");
        // Both are linear in the spectrum.
        let half = to_rgb(&[(300.0, 0.5), (500.0, 0.5), (900.0, 0.5)], Illuminant::D65);
        assert!(half.distance(white / 2.0) < 1e-15);
    }

    #[test]
    fn black_bodies() {
        // Maxima of Wien's law are at 2898 µm K / T: the colour goes from red over white to blue.
        let color = |t: f64| blackbody(t) / blackbody(t).max_element();
        let (candle, sun, sky) = (color(1900.0), color(6504.0), color(20000.0));
        assert!(candle.x == 1.0 && candle.y < 0.45 && candle.z < 0.1, "{candle}");
        assert!(sun.distance(DVec3::ONE) < 0.1, "{sun}");
        assert!(sky.z == 1.0 && sky.x < 0.6, "{sky}");
        // What Mitsuba 3.9.1's spectral variant renders, with a million samples.
        let expected = DVec3::new(15276.83, 12094.598, 9603.266);
        assert!((blackbody(5000.0) / expected - DVec3::ONE).abs().max_element() < 5e-4, "{}", blackbody(5000.0));
        // Power grows with temperature, and coldness is no NaN.
        assert!(blackbody(3000.0).y < blackbody(3001.0).y);
        assert_eq!(blackbody(1.0), DVec3::ZERO);
    }
}
