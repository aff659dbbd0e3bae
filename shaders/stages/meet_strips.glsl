// Stage `solve_strips` from both ends (server/solver/method.md, "solve_strips"), spread over a work group: each
// invocation linearises some links of a phase, one invocation per strip eliminates its rows from both ends towards
// the middle, and each applies the impulses of its links. So only the pivots are found one after the other. Resident
// plan only.
#include "stages/access_resident.glsl"
#include "stages/solve_strips.glsl"

// A phase has at most CAPACITY links.
const uint kLinksPerLane = (uint(CAPACITY) + uint(LOCAL_SIZE) - 1u) / uint(LOCAL_SIZE);

// Four numbers of each link of a phase, by the steps of MeetStrips:
//   0  -                    effect of the impulse before on this error [1/kg]; at the first link of a strip: whether
//                           any of the strip has an error larger than the tolerance
//   1  direction.x          effect of the impulse after on this error [1/kg]                            pull.x [N s]
//   2  direction.y          diagonal [1/kg], negative if `to` is a pin; ratio of EliminateRow           pull.y
//   3  direction.z          right side [m/s]; over the pivot [N s]; impulse [N s]                       pull.z
shared float shared_rows[4u * kPlaceCount];
shared uint shared_has_excess;  // whether a particle of the phase moves too far

float RowOf(uint number, uint link) { return shared_rows[number * kPlaceCount + PlaceOf(link)]; }
void SetRow(uint number, uint link, float x) { shared_rows[number * kPlaceCount + PlaceOf(link)] = x; }
vec3 RowVector(uint link) { return vec3(RowOf(1u, link), RowOf(2u, link), RowOf(3u, link)); }
void SetRowVector(uint link, vec3 v) {
  SetRow(1u, link, v.x);
  SetRow(2u, link, v.y);
  SetRow(3u, link, v.z);
}

// A link of this invocation.
struct SideLink {
  bool is_link;
  uint place;  // in the lists of links
  uint index;  // in its phase
  uint k;      // in its strip
  uint link_count;  // of its strip
  uint from;        // particles
  uint to;
  LinearisedLink link;
  float impulse;   // [N s]
  bool is_active;  // any link of its strip has an error larger than the tolerance
  float largest_ratio_sq;  // MoveRatioSq of the particles that it moves
};

uint FirstOfStrip(SideLink mine) { return mine.index - mine.k; }
bool HasNext(SideLink mine) { return mine.k + 1u < mine.link_count; }

SideLink LoadSideLink(uint begin, uint end, uint index, bool is_first_sweep) {
  DistanceError no_error = DistanceError(vec3(0.0), 0.0);
  SideLink mine = SideLink(begin + index < end, begin + index, index, 0u, 0u, 0u, 0u,
                           LinearisedLink(0.0, no_error, vec3(0.0), 1.0), 0.0, false, 0.0);
  if (!mine.is_link) return mine;
  uint ends = models[cloth.model.strip_ends + mine.place];
  uint turn = models[cloth.model.strip_turns + mine.place];
  mine.from = ends & 0xffffu;
  mine.to = ends >> 16;
  mine.k = turn & 0xffffu;
  mine.link_count = turn >> 16;
  mine.link = LineariseLink(mine.place, ModelFloat(cloth.model.strip_lengths + mine.place), LoadEnd(mine.from),
                            LoadEnd(mine.to), is_first_sweep);
  return mine;
}

// The effects of its neighbours' impulses on its error [1/kg].
struct Neighbours {
  float before;
  float after;
};

Neighbours LoadNeighbours(SideLink mine) {
  Neighbours effects = Neighbours(0.0, 0.0);
  if (!mine.is_link) return effects;
  vec3 n_end = mine.link.error.direction;
  if (mine.k > 0u) effects.before = StripCoupling(RowVector(mine.index - 1u), n_end, InverseMass(mine.from));
  if (HasNext(mine)) effects.after = StripCoupling(RowVector(mine.index + 1u), n_end, InverseMass(mine.to));
  return effects;
}

void StoreRow(SideLink mine, Neighbours effects) {
  if (!mine.is_link) return;
  if (mine.k > 0u) SetRow(0u, mine.index, effects.before);
  if (IsBeyondTolerance(mine.link)) SetRow(0u, FirstOfStrip(mine), 1.0);  // all writers write the same
  SetRow(1u, mine.index, effects.after);
  SetRow(2u, mine.index, InverseMass(mine.to) == 0.0 ? -mine.link.diagonal : mine.link.diagonal);
  SetRow(3u, mine.index, StripRightSide(mine.link.error.residual, substep.inverse_interval));
}

// A row as the elimination meets it, forwards or backwards. No effects for the first one.
struct HalfRow {
  float coupling;          // effect of the impulse before on this error [1/kg]
  float effect_on_before;  // of this impulse on the error before [1/kg]
  float diagonal;
  float min_pivot;
  float right_side;
};

// The j-th row of the strip's links from `first` on.
HalfRow LoadForwards(uint first, uint j) {
  uint link = first + j;
  float diagonal = RowOf(2u, link);
  HalfRow row = HalfRow(0.0, 0.0, abs(diagonal), MinPivot(diagonal < 0.0 ? 0.0 : 1.0), RowOf(3u, link));
  if (j > 0u) {
    row.coupling = RowOf(0u, link);
    row.effect_on_before = RowOf(1u, link - 1u);
  }
  return row;
}
HalfRow LoadBackwards(uint first, uint link_count, uint j) {
  uint k = link_count - 1u - j;
  uint link = first + k;
  float end = k > 0u ? RowOf(2u, link - 1u) : 0.0;  // negative: the particle before is a pin
  HalfRow row = HalfRow(0.0, 0.0, abs(RowOf(2u, link)), MinPivot(end < 0.0 ? 0.0 : 1.0), RowOf(3u, link));
  if (j > 0u) {
    row.coupling = RowOf(1u, link);
    row.effect_on_before = RowOf(0u, link + 1u);
  }
  return row;
}

// One end of the elimination.
struct HalfStrip {
  StripPivot pivot;   // of its last row
  float ratio;        // there
  float least_pivot;  // there [1/kg]
};

void Eliminate(HalfRow row, inout HalfStrip half_strip) {
  precise float ratio = row.effect_on_before * half_strip.pivot.inverse_pivot;
  half_strip.ratio = ratio;
  half_strip.pivot = EliminateRow(row.diagonal, row.min_pivot, row.right_side, row.coupling, ratio,
                                  half_strip.pivot.right_side);
  precise float least_pivot = row.min_pivot * row.diagonal;
  half_strip.least_pivot = least_pivot;
}

// Between two pins a strip has a link too many, whose pivot the elimination raises where it ends at a pin. Backwards
// that would be another link, with other impulses; so a strip with pins in its second half is not divided. The number
// of links of the first half, which has the middle one.
uint LinksOfFirstHalf(uint first, uint link_count) {
  uint of_first = (link_count + 1u) / 2u;
  bool has_pin = false;
  for (uint k = of_first; k < link_count; ++k) {
    if (RowOf(2u, first + k) < 0.0) has_pin = true;
  }
  return has_pin ? link_count : of_first;
}

// The impulses of the last links of both halves [N s]. The effects are those of the other's impulse.
vec2 MeetingImpulses(HalfStrip forwards, HalfStrip backwards, float effect_on_forwards, float effect_on_backwards) {
  StripPivot one = forwards.pivot;
  StripPivot other = backwards.pivot;
  precise float one_of_other = effect_on_forwards * one.inverse_pivot;
  precise float other_of_one = effect_on_backwards * other.inverse_pivot;
  precise float pivot = 1.0 - one_of_other * other_of_one;  // over that of either link
  precise float least_of_one = forwards.least_pivot * one.inverse_pivot;
  precise float least_of_other = backwards.least_pivot * other.inverse_pivot;
  float inverse_pivot = Quotient(1.0, max(pivot, max(least_of_one, least_of_other)));
  precise float one_alone = one.right_side - one_of_other * other.right_side;
  precise float other_alone = other.right_side - other_of_one * one.right_side;
  precise vec2 impulses = vec2(one_alone, other_alone) * inverse_pivot;
  return impulses;
}

// Replaces the rows of a strip by its impulses. Both halves advance together, and each loop loads what the next pass
// needs before it stores, so that the latencies overlap.
void SolveRows(uint first, uint link_count) {
  uint of_first = LinksOfFirstHalf(first, link_count);
  uint of_second = link_count - of_first;
  HalfStrip forwards = HalfStrip(StripPivot(0.0, 0.0), 0.0, 0.0);
  HalfStrip backwards = forwards;
  HalfRow row = LoadForwards(first, 0u);
  HalfRow row_back = LoadBackwards(first, link_count, 0u);
  for (uint j = 0u; j < of_first; ++j) {
    uint next = min(j + 1u, of_first - 1u);
    HalfRow next_row = LoadForwards(first, next);
    HalfRow next_row_back = LoadBackwards(first, link_count, next);
    HalfStrip next_backwards = backwards;
    Eliminate(row, forwards);
    Eliminate(row_back, next_backwards);
    SetRow(2u, first + j, forwards.ratio);
    SetRow(3u, first + j, forwards.pivot.right_side);
    if (j < of_second) {
      uint link = first + link_count - 1u - j;
      backwards = next_backwards;
      SetRow(2u, link, backwards.ratio);
      SetRow(3u, link, backwards.pivot.right_side);
    }
    row = next_row;
    row_back = next_row_back;
  }

  uint last = first + of_first - 1u;  // of the first half
  precise vec2 impulses = vec2(forwards.pivot.right_side, backwards.pivot.right_side);
  if (of_second > 0u) {
    impulses = MeetingImpulses(forwards, backwards, RowOf(1u, last), RowOf(0u, last + 1u));
  }
  precise vec2 effects = vec2(forwards.ratio, backwards.ratio) * impulses;  // on the next impulses
  SetRow(3u, last, impulses.x);
  if (of_second > 0u) SetRow(3u, last + 1u, impulses.y);
  for (uint j = 1u; j < of_first; ++j) {
    uint link = last - j;
    uint link_back = last + 1u + min(j, max(of_second, 1u) - 1u);
    vec2 ratios = vec2(RowOf(2u, link), of_second > 0u ? RowOf(2u, link_back) : 0.0);
    vec2 alone = vec2(RowOf(3u, link), of_second > 0u ? RowOf(3u, link_back) : 0.0);
    impulses = alone - effects;
    effects = ratios * impulses;
    SetRow(3u, link, impulses.x);
    if (j < of_second) SetRow(3u, link_back, impulses.y);
  }
}

// Moves the particles of a link, its second one and the first one of the strip, by the pulls in the rows. Returns the
// largest MoveRatioSq.
float PullEnds(SideLink mine) {
  vec3 pull = RowVector(mine.index);
  vec3 pull_of_next = HasNext(mine) ? RowVector(mine.index + 1u) : vec3(0.0);
  float ratio_sq = PullParticle(mine.to, pull, pull_of_next, mine.link.rest_length);
  if (mine.k > 0u) return ratio_sq;
  return max(ratio_sq, PullParticle(mine.from, vec3(0.0), pull, mine.link.rest_length));
}

void StorePull(SideLink mine, float share) {
  precise float applied = share * mine.impulse;
  AccumulateImpulse(mine.place, applied);
  precise vec3 pull = applied * mine.link.direction;
  SetRowVector(mine.index, pull);
}

// The impulses moved particles too far, which is rare: takes back what is too much in each strip.
void RemoveExcess(SideLink mine[kLinksPerLane]) {
  for (uint m = 0u; m < kLinksPerLane; ++m) {
    if (mine[m].is_link) SetRow(0u, mine[m].index, mine[m].largest_ratio_sq);
  }
  PhaseBarrier();
  for (uint m = 0u; m < kLinksPerLane; ++m) {
    float largest_ratio_sq = 0.0;
    for (uint k = 0u; k < mine[m].link_count; ++k) {
      largest_ratio_sq = max(largest_ratio_sq, RowOf(0u, FirstOfStrip(mine[m]) + k));
    }
    precise float back = ShareOfMove(largest_ratio_sq) - 1.0;
    mine[m].is_active = back != 0.0;
    if (mine[m].is_active) StorePull(mine[m], back);
  }
  PhaseBarrier();
  for (uint m = 0u; m < kLinksPerLane; ++m) {
    if (mine[m].is_active) PullEnds(mine[m]);
  }
}

// The strips of a phase. In uniform control flow.
void MeetStrips(uint begin, uint end, bool is_first_sweep) {
  uint first_link = models[cloth.model.strip_offsets + begin];
  uint end_link = models[cloth.model.strip_offsets + end];
  SideLink mine[kLinksPerLane];
  for (uint m = 0u; m < kLinksPerLane; ++m) {
    uint index = gl_LocalInvocationID.x + m * uint(LOCAL_SIZE);
    mine[m] = LoadSideLink(first_link, end_link, index, is_first_sweep);
    if (!mine[m].is_link) continue;
    SetRowVector(index, mine[m].link.direction);
    if (mine[m].k == 0u) SetRow(0u, index, 0.0);
  }
  PhaseBarrier();

  Neighbours effects[kLinksPerLane];
  for (uint m = 0u; m < kLinksPerLane; ++m) effects[m] = LoadNeighbours(mine[m]);
  PhaseBarrier();
  for (uint m = 0u; m < kLinksPerLane; ++m) StoreRow(mine[m], effects[m]);
  if (gl_LocalInvocationID.x == 0u) shared_has_excess = 0u;
  PhaseBarrier();

  FOR_EACH(strip, begin, end) {
    uint first = models[cloth.model.strip_offsets + strip] - first_link;
    uint after = models[cloth.model.strip_offsets + strip + 1u] - first_link;
    if (RowOf(0u, first) != 0.0) SolveRows(first, after - first);
  }
  PhaseBarrier();

  for (uint m = 0u; m < kLinksPerLane; ++m) {
    if (!mine[m].is_link) continue;
    mine[m].is_active = RowOf(0u, FirstOfStrip(mine[m])) != 0.0;
    mine[m].impulse = RowOf(3u, mine[m].index);
    if (mine[m].is_active) StorePull(mine[m], 1.0);
  }
  PhaseBarrier();
  for (uint m = 0u; m < kLinksPerLane; ++m) {
    if (!mine[m].is_active) continue;
    MarkChanged();
    mine[m].largest_ratio_sq = PullEnds(mine[m]);
    if (mine[m].largest_ratio_sq > 1.0) shared_has_excess = 1u;  // all writers write the same
  }
  PhaseBarrier();
  if (shared_has_excess != 0u) RemoveExcess(mine);
}
