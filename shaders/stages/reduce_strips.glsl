// Stage `solve_strips` by cyclic reduction: each lane solves one link of a strip, all at once
// (server/solver/method.md, "solve_strips"). Resident plan only.
#include "lib/strip_reduction.glsl"
#include "stages/lanes.glsl"
#include "stages/solve_strips.glsl"

// A link as its lane knows it; lanes without a link have one that does nothing.
struct LaneLink {
  bool is_link;
  uint from;        // particles
  uint to;
  LinearisedLink link;
};

LaneLink LoadLaneLink(Strip strip, bool is_first_sweep) {
  DistanceError no_error = DistanceError(vec3(0.0), 0.0);
  LaneLink mine = LaneLink(Lane() < strip.link_count, 0u, 0u,
                           LinearisedLink(0.0, no_error, vec3(0.0), 1.0));
  if (!mine.is_link) return mine;
  uint k = Lane();
  mine.from = StripParticle(strip, k);
  mine.to = StripParticle(strip, k + 1u);
  mine.link = LineariseLink(StripLinkAt(strip, k), StripRestLength(strip, k), LoadEnd(mine.from), LoadEnd(mine.to),
                            is_first_sweep);
  return mine;
}

// A lane index beyond all.
const uint kNoLane = DRAPE_STRIP_LANES;

uint LaneBefore(uint stride) { return Lane() >= stride ? Lane() - stride : Lane(); }
uint LaneAfter(uint stride) {
  return Lane() + stride < DRAPE_STRIP_LANES ? Lane() + stride : Lane();
}

StripRow LoadRow(LaneLink mine, bool has_next) {
  Offer(vec4(mine.link.direction, 0.0), 0u);
  vec3 direction_before = OfferOf(LaneBefore(1u)).xyz;
  vec3 direction_after = OfferOf(LaneAfter(1u)).xyz;
  if (!mine.is_link) return StripRow(0.0, 0.0, 0.0, 1.0);
  vec3 n_end = mine.link.error.direction;
  float from_before = 0.0;
  float from_after = 0.0;
  if (Lane() > 0u) from_before = StripCoupling(direction_before, n_end, InverseMass(mine.from));
  if (has_next) from_after = StripCoupling(direction_after, n_end, InverseMass(mine.to));
  float right_side = StripRightSide(mine.link.error.residual, substep.inverse_interval);
  return FirstRow(mine.link.diagonal, from_before, from_after, right_side);
}

// As MinPivot. The pivot of an elimination depends on the particles on one side of the link, that of a reduction
// on those on both sides, so its bound is lower.
float MinReducedPivot(uint to) {
  return InverseMass(to) == 0.0 ? MIN_STRIP_PIVOT_AT_PIN
                                : MIN_STRIP_PIVOT / float(DRAPE_STRIP_LANES);
}

// The impulse of this lane's link [N s].
float ReduceLink(LaneLink mine, bool has_next) {
  StripRow row = LoadRow(mine, has_next);
  float min_pivot = mine.is_link ? MinReducedPivot(mine.to) : 1.0;
  // The next link, this one included, that ends at a pin; that link is eliminated from no other.
  uint last = mine.is_link && InverseMass(mine.to) == 0.0 ? Lane() : kNoLane;
  precise float pivot = 1.0;  // over the diagonal
  for (uint stride = 1u; stride < DRAPE_STRIP_LANES; stride *= 2u) {
    Offer(PackRow(row), last);
    StripRow row_before = UnpackRow(OfferOf(LaneBefore(stride)));
    StripRow row_after = UnpackRow(OfferOf(LaneAfter(stride)));
    uint last_after = TagOf(LaneAfter(stride));
    last = min(last, last_after);
    bool has_after = Lane() + stride < last;
    ReducedRow reduced = ReduceRow(row, row_before, row_after, has_after, Quotient(min_pivot, pivot));
    row = reduced.row;
    pivot = pivot * reduced.pivot;
  }
  Offer(vec4(row.right_side), 0u);
  float impulse_of_last = OfferOf(last < kNoLane ? last : Lane()).x;
  if (last == kNoLane || last == Lane()) return row.right_side;
  precise float impulse = row.right_side - row.after * impulse_of_last;
  return impulse;
}

// The largest x of the lanes, and whether any lane has the flag.
struct LaneMaximum {
  float x;
  bool has_flag;
};

LaneMaximum MaximumOfLanes(float x, bool has_flag) {
  float flag = has_flag ? 1.0 : 0.0;
  for (uint distance = 1u; distance < DRAPE_STRIP_LANES; distance *= 2u) {
    Offer(vec4(x, flag, 0.0, 0.0), 0u);
    vec2 other = OfferOf(Lane() ^ distance).xy;
    x = max(x, other.x);
    flag = max(flag, other.y);
  }
  return LaneMaximum(x, flag != 0.0);
}

void ChangeVelocity(uint i, float share, vec3 change) {
  if (InverseMass(i) == 0.0) return;
  SetVelocity(i, AddScaled(Velocity(i), share, change));
}

// One strip by one group of lanes. A group without links takes part in the same uniform control flow and changes
// nothing.
void ReduceStrip(Strip strip, bool is_first_sweep) {
  LaneLink mine = LoadLaneLink(strip, is_first_sweep);
  bool has_next = Lane() + 1u < strip.link_count;
  float impulse = ReduceLink(mine, has_next);

  // A lane moves the second particle of its link, the first one also the first.
  precise vec3 pull = impulse * mine.link.direction;
  Offer(vec4(pull, 0.0), 0u);
  vec3 pull_of_next = OfferOf(LaneAfter(1u)).xyz;
  if (!has_next) pull_of_next = vec3(0.0);
  vec3 change_of_first = vec3(0.0);
  vec3 change = vec3(0.0);
  float largest_ratio_sq = 0.0;
  if (mine.is_link) {
    precise vec3 scaled = InverseMass(mine.to) * (pull - pull_of_next);
    change = scaled;
    largest_ratio_sq = MoveRatioSq(change, mine.link.rest_length);
    if (Lane() == 0u) {
      precise vec3 scaled_of_first = InverseMass(mine.from) * -pull;
      change_of_first = scaled_of_first;
      largest_ratio_sq =
          max(largest_ratio_sq, MoveRatioSq(change_of_first, mine.link.rest_length));
    }
  }
  LaneMaximum maximum =
      MaximumOfLanes(largest_ratio_sq, mine.is_link && IsBeyondTolerance(mine.link));
  LaneBarrier();
  if (!mine.is_link || !maximum.has_flag) return;
  MarkChanged();
  float share = ShareOfMove(maximum.x);
  precise float applied = share * impulse;
  AccumulateImpulse(StripLinkAt(strip, Lane()), applied);
  if (Lane() == 0u) ChangeVelocity(mine.from, share, change_of_first);
  ChangeVelocity(mine.to, share, change);
}

// The strips of a phase, as many at a time as there are groups of lanes.
void ReduceStrips(uint first, uint last, bool is_first_sweep) {
  for (uint round = first; round < last; round += LaneGroupCount()) {
    uint index = round + LaneGroup();
    Strip strip = NoStrip();
    if (LaneGroup() < LaneGroupCount() && index < last) strip = LoadStrip(index);
    ReduceStrip(strip, is_first_sweep);
  }
}
