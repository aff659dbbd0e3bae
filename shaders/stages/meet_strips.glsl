// Stage `solve_strips` from both ends: two invocations eliminate the links of a strip towards its middle, each as if
// its half were a strip, and solve for the last two links together (server/solver/method.md, "solve_strips"). Half as
// many links follow each other as from one end, with the same arithmetic for each. Resident plan only.
#include "stages/access_resident.glsl"
#include "stages/solve_strips.glsl"

// Invocations that take part: the first half of them begin at the first links, the others at the last ones.
const uint kHalfCount = (uint(LOCAL_SIZE) < DRAPE_STRIP_HALVES ? uint(LOCAL_SIZE) : DRAPE_STRIP_HALVES) / 2u;

// What a half tells the other one: EliminatedStrip.
const uint kMeetingWords = 10u;
shared float shared_meetings[kMeetingWords * 2u * kHalfCount];
shared float shared_move_ratios[2u * kHalfCount];

// Between two pins a strip has a link too many, whose pivot the elimination raises where it ends at a pin. Backwards
// that would be another link, with other impulses; so a strip with pins in its second half is not divided.
bool HasPinAfter(Strip strip, uint middle) {
  bool has_pin = false;
  for (uint k = middle + 1u; k <= strip.link_count; ++k) {
    if (InverseMass(StripParticle(strip, k)) == 0.0) has_pin = true;
  }
  return has_pin;
}

// The first half of a strip, which has the middle link, or the second one backwards.
Strip HalfOf(Strip strip, bool is_second) {
  uint of_first = (strip.link_count + 1u) / 2u;
  if (HasPinAfter(strip, of_first)) of_first = strip.link_count;
  if (!is_second) {
    strip.link_count = of_first;
    return strip;
  }
#ifdef HAS_REGULAR_STRIPS
  strip.first += strip.stride * strip.link_count;
  strip.stride = 0u - strip.stride;
#else
  strip.particles += strip.link_count;
#endif
  strip.first_link += strip.link_count - 1u;
  strip.step = 0u - 1u;
  strip.link_count -= of_first;
  return strip;
}

void StoreMeeting(uint lane, EliminatedStrip half_strip) {
  uint word = kMeetingWords * lane;
  for (int axis = 0; axis < 3; ++axis) {
    shared_meetings[word + uint(axis)] = half_strip.last.direction[axis];
    shared_meetings[word + 3u + uint(axis)] = half_strip.last.n_end[axis];
  }
  shared_meetings[word + 6u] = half_strip.last.inverse_pivot;
  shared_meetings[word + 7u] = half_strip.last.right_side;
  shared_meetings[word + 8u] = half_strip.least_pivot;
  shared_meetings[word + 9u] = half_strip.is_active ? 1.0 : 0.0;
}

EliminatedStrip LoadMeeting(uint lane) {
  uint word = kMeetingWords * lane;
  vec3 direction = vec3(shared_meetings[word], shared_meetings[word + 1u], shared_meetings[word + 2u]);
  vec3 n_end = vec3(shared_meetings[word + 3u], shared_meetings[word + 4u], shared_meetings[word + 5u]);
  StripLink last = StripLink(direction, n_end, shared_meetings[word + 6u], shared_meetings[word + 7u]);
  return EliminatedStrip(shared_meetings[word + 9u] != 0.0, last, shared_meetings[word + 8u]);
}

// The impulses of this half's last link, and of the other half's [N s].
vec2 MeetingImpulses(EliminatedStrip mine, EliminatedStrip other, float inverse_mass) {
  // Both links point to the particle between them.
  float effect_on_mine = -StripCoupling(other.last.direction, mine.last.n_end, inverse_mass);
  float effect_on_other = -StripCoupling(mine.last.direction, other.last.n_end, inverse_mass);
  precise float mine_of_other = effect_on_mine * mine.last.inverse_pivot;
  precise float other_of_mine = effect_on_other * other.last.inverse_pivot;
  precise float pivot = 1.0 - mine_of_other * other_of_mine;  // over that of either link
  precise float least_of_mine = mine.least_pivot * mine.last.inverse_pivot;
  precise float least_of_other = other.least_pivot * other.last.inverse_pivot;
  float inverse_pivot = Quotient(1.0, max(pivot, max(least_of_mine, least_of_other)));
  precise float mine_alone = mine.last.right_side - mine_of_other * other.last.right_side;
  precise float other_alone = other.last.right_side - other_of_mine * mine.last.right_side;
  precise vec2 impulses = vec2(mine_alone, other_alone) * inverse_pivot;
  return impulses;
}

// The strip of this invocation in the round that begins with strip `round` of a phase that ends before `end`.
Strip LoadHalf(uint round, uint end) {
  uint lane = gl_LocalInvocationID.x;
  uint index = round + lane % kHalfCount;
  if (lane >= 2u * kHalfCount || index >= end) return NoStrip();
  return HalfOf(LoadStrip(index), lane >= kHalfCount);
}

// The impulses moved a particle too far, which is rare.
void RemoveExcess(Strip strip, float back, float last_impulse, vec3 pull_of_other, bool moves_last) {
  precise vec3 pull_back = back * pull_of_other;
  ApplyImpulses(strip, back, last_impulse, -pull_back, moves_last);
}

// In uniform control flow.
void MeetStrips(uint begin, uint end, bool is_first_sweep) {
  uint lane = gl_LocalInvocationID.x;
  bool is_second = lane >= kHalfCount;
  uint other_lane = is_second ? lane - kHalfCount : lane + kHalfCount;
  for (uint round = begin; round < end; round += kHalfCount) {
    Strip strip = LoadHalf(round, end);
    EliminatedStrip mine = EliminatedStrip(false, StripLink(vec3(0.0), vec3(0.0), 0.0, 0.0), 0.0);
    if (strip.link_count > 0u) mine = EliminateStrip(strip, is_first_sweep);
    if (lane < 2u * kHalfCount) StoreMeeting(lane, mine);
    PhaseBarrier();
    float largest_ratio_sq = 0.0;
    vec2 impulses = vec2(mine.last.right_side, 0.0);
    precise vec3 pull_of_other = vec3(0.0);
    bool is_active = false;
    if (strip.link_count > 0u) {
      EliminatedStrip other = LoadMeeting(other_lane);
      is_active = mine.is_active || other.is_active;
      float inverse_mass = InverseMass(StripParticle(strip, strip.link_count));
      if (other.last.inverse_pivot != 0.0) impulses = MeetingImpulses(mine, other, inverse_mass);
      pull_of_other = impulses.y * other.last.direction;
    }
    if (is_active) {
      MarkChanged();
      largest_ratio_sq = ApplyImpulses(strip, 1.0, impulses.x, -pull_of_other, !is_second);
    }
    if (lane < 2u * kHalfCount) shared_move_ratios[lane] = largest_ratio_sq;
    PhaseBarrier();
    if (!is_active) continue;
    precise float back = ShareOfMove(max(largest_ratio_sq, shared_move_ratios[other_lane])) - 1.0;
    if (back != 0.0) RemoveExcess(strip, back, impulses.x, pull_of_other, !is_second);
  }
}
