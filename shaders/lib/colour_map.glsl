// Colours of values. Both maps take t in 0..1 and give linear RGB.

vec3 LinearFromSrgb(vec3 c) {
  return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045)));
}

// viridis of matplotlib (S. van der Walt, N. Smith, 2015; CC0) by the polynomial of degree 6 that M. Zucker
// fitted to it (https://www.shadertoy.com/view/WlfXRN, CC0). Perceptually uniform.
vec3 SpeedColour(float t) {
  const vec3 c0 = vec3(0.2777273272234177, 0.005407344544966578, 0.3340998053353061);
  const vec3 c1 = vec3(0.1050930431085774, 1.404613529898575, 1.384590162594685);
  const vec3 c2 = vec3(-0.3308618287255563, 0.214847559468213, 0.09509516302823659);
  const vec3 c3 = vec3(-4.634230498983486, -5.799100973351585, -19.33244095627987);
  const vec3 c4 = vec3(6.228269936347081, 14.17993336680509, 56.69055260068105);
  const vec3 c5 = vec3(4.776384997670288, -13.74514537774601, -65.35303263337234);
  const vec3 c6 = vec3(-5.435455855934631, 4.645852612178535, 26.3124352495832);
  t = clamp(t, 0.0, 1.0);
  vec3 srgb = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * (c5 + t * c6)))));
  return LinearFromSrgb(clamp(srgb, 0.0, 1.0));
}

// Blue, white, red: the ends and the quarters of ColorBrewer's RdBu (C. Brewer, Apache 2.0), interpolated in
// linear light.
vec3 StrainColour(float t) {
  const vec3 low = vec3(0.0159, 0.1195, 0.4125);        // #2166ac
  const vec3 low_mid = vec3(0.2874, 0.5583, 0.7305);    // #92c5de
  const vec3 middle = vec3(0.9301, 0.9301, 0.9301);     // #f7f7f7
  const vec3 high_mid = vec3(0.9047, 0.3763, 0.2232);   // #f4a582
  const vec3 high = vec3(0.4452, 0.0091, 0.0242);       // #b2182b
  t = 4.0 * clamp(t, 0.0, 1.0);
  if (t < 1.0) return mix(low, low_mid, t);
  if (t < 2.0) return mix(low_mid, middle, t - 1.0);
  if (t < 3.0) return mix(middle, high_mid, t - 2.0);
  return mix(high_mid, high, t - 3.0);
}
