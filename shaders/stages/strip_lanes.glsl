// Lanes of a strip: what those that solve it hand each other, whether each has one particle of it or two. Resident plan
// only.
#ifndef DRAPE_STAGES_STRIP_LANES_GLSL_
#define DRAPE_STAGES_STRIP_LANES_GLSL_

#include "stages/lanes.glsl"
#include "stages/solve_strips.glsl"

uint LaneBefore(uint stride) { return Lane() - min(stride, Lane()); }
uint LaneAfter(uint stride) { return min(Lane() + stride, DRAPE_STRIP_LANES - 1u); }

// That of another lane of the group.
LinkEnd TakeEnd(LinkEnd end, uint lane) {
  Offer(vec4(end.position, end.inverse_mass));
  vec4 of_position = OfferOf(lane);
  Offer(vec4(end.velocity, end.quiet_round_off));
  vec4 of_velocity = OfferOf(lane);
  return LinkEnd(of_position.xyz, of_velocity.xyz, of_position.w, of_velocity.w);
}

// A link that has no error and no effect.
LinearisedLink NoLink(float rest_length) {
  return LinearisedLink(rest_length, DistanceError(vec3(0.0), 0.0), vec3(0.0), 1.0);
}

// The largest value of the lanes of the strip, which are given by their bits, if it is not negative.
float TakeLargest(uint lanes, float value) {
  Offer(vec4(value));
  float largest = 0.0;
  for (uint lane = 0u; lane < DRAPE_STRIP_LANES; ++lane) {
    float other = OfferOf(lane).x;
    if ((lanes >> lane & 1u) != 0u) largest = max(largest, other);
  }
  return largest;
}

// Whether a strip, of which any lane `has_error`, is to be solved. Without a tolerance impulses of 0 may be applied too.
bool IsActive(uint lanes, bool has_error) {
#ifdef HAS_TOLERANCE
  return (LanesWith(has_error) & lanes) != 0u;
#else
  return true;
#endif
}

#endif
