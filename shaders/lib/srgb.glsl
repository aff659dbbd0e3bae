// The sRGB transfer function (IEC 61966-2-1) and its inverse, by polynomials: powers would be most of the time of a
// small picture on a software renderer.

// From linear light, 0..1; off by at most 0.12 of 255. A least-squares fit in the root of the light.
vec3 SrgbFromLinear(vec3 light) {
  vec3 s = sqrt(light);
  vec3 high = ((((0.41563907 * s - 1.3546827) * s + 1.7751776) * s - 1.2969983) * s + 1.5002971) * s - 0.039255287;
  return mix(high, 12.92 * light, lessThan(light, vec3(0.0031308)));
}

// To linear light; there and back it is off by at most 0.4 of 255.
vec3 NearLinearFromSrgb(vec3 c) {
  vec3 high = (((-0.08564527 * c + 0.46673778) * c + 0.59622574) * c + 0.021225652) * c + 0.0013822832;
  return mix(high, c / 12.92, lessThan(c, vec3(0.04045)));
}
