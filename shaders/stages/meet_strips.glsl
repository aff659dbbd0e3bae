// Stage `solve_strips` from both ends (server/solver/method.md, "solve_strips"), spread over a work group: each
// invocation linearises some links of a phase, one invocation per strip eliminates its rows from both ends towards
// the middle, and each applies the impulses of its links. So only the pivots are found one after the other. Resident
// plan only.
#include "stages/access_resident.glsl"
#include "stages/solve_strips.glsl"

// A phase has at most CAPACITY links.
const uint kLinksPerLane = (uint(CAPACITY) + uint(LOCAL_SIZE) - 1u) / uint(LOCAL_SIZE);

// Four numbers of each link of a phase, by the steps of MeetStrips:
//   x  -             effect of the impulse before on this error [1/kg]; at the first link of a strip: whether any of
//                    the strip has an error larger than the tolerance
//   y  direction.x   effect of the impulse after on this error [1/kg]                                    pull.x [N s]
//   z  direction.y   diagonal [1/kg], negative if `to` is a pin; ratio of EliminateRow                   pull.y
//   w  direction.z   right side [m/s]; over the pivot [N s]; impulse [N s]                               pull.z
// The links of a strip are neighbours, strips an odd number of rows apart where there is room: one invocation per
// strip then meets no bank twice.
// SolveRows reads one row more than there are.
shared vec4 shared_rows[kPlaceCount + 1u];
shared uint shared_has_excess;  // whether a particle of the phase moves too far

vec3 RowVector(uint row) {
  vec4 numbers = shared_rows[row];
  return vec3(numbers.y, numbers.z, numbers.w);
}

// The place of a link in its strip, and of its row.
struct Turn {
  uint k;
  uint link_count;  // of the strip
  uint row;
};

Turn LoadTurn(uint place) {
  uint word = models[cloth.model.strip_turns + place];
  return Turn(word & 0x3ffu, (word >> 10 & 0x3ffu) + 1u, word >> 20);
}

// A link of this invocation.
struct SideLink {
  bool is_link;
  uint place;  // in the lists of links
  Turn turn;
  uint from;  // particles
  uint to;
  LinearisedLink link;
  float impulse;   // [N s]
  bool is_active;  // any link of its strip has an error larger than the tolerance
};

uint FirstRow(Turn turn) { return turn.row - turn.k; }
bool HasNext(Turn turn) { return turn.k + 1u < turn.link_count; }

SideLink LoadSideLink(uint place, uint end, bool is_first_sweep) {
  DistanceError no_error = DistanceError(vec3(0.0), 0.0);
  SideLink mine = SideLink(place < end, place, Turn(0u, 0u, 0u), 0u, 0u,
                           LinearisedLink(0.0, no_error, vec3(0.0), 1.0), 0.0, false);
  if (!mine.is_link) return mine;
  uint ends = models[cloth.model.strip_ends + place];
  float rest_length = ModelFloat(cloth.model.strip_lengths + place);
  mine.turn = LoadTurn(place);
  mine.from = ends & 0xffffu;
  mine.to = ends >> 16;
  mine.link = LineariseLink(place, rest_length, LoadEnd(mine.from), LoadEnd(mine.to), is_first_sweep);
  return mine;
}

// The effects of its neighbours' impulses on its error, before and after it [1/kg].
vec2 LoadNeighbours(SideLink mine) {
  vec2 effects = vec2(0.0);
  if (!mine.is_link) return effects;
  vec3 n_end = mine.link.error.direction;
  if (mine.turn.k > 0u) {
    effects.x = StripCoupling(RowVector(mine.turn.row - 1u), n_end, InverseMass(mine.from));
  }
  if (HasNext(mine.turn)) {
    effects.y = StripCoupling(RowVector(mine.turn.row + 1u), n_end, InverseMass(mine.to));
  }
  return effects;
}

void StoreRow(SideLink mine, vec2 effects) {
  if (!mine.is_link) return;
  float diagonal = InverseMass(mine.to) == 0.0 ? -mine.link.diagonal : mine.link.diagonal;
  float right_side = StripRightSide(mine.link.error.residual, substep.inverse_interval);
  if (mine.turn.k > 0u) {
    shared_rows[mine.turn.row] = vec4(effects, diagonal, right_side);
  } else {  // whose x others write
    shared_rows[mine.turn.row].y = effects.y;
    shared_rows[mine.turn.row].z = diagonal;
    shared_rows[mine.turn.row].w = right_side;
  }
  if (IsBeyondTolerance(mine.link)) shared_rows[FirstRow(mine.turn)].x = 1.0;  // all writers write the same
}

// Between two pins a strip has a link too many, whose pivot the elimination raises where it ends at a pin. Backwards
// that would be another link, with other impulses; so a strip with pins in its second half is not divided. The number
// of links of the first half, which has the middle one.
uint LinksOfFirstHalf(uint first, uint link_count) {
  uint of_first = (link_count + 1u) / 2u;
  float least = 0.0;
  for (uint row = first + of_first; row < first + link_count; ++row) least = min(least, shared_rows[row].z);
  return least < 0.0 ? link_count : of_first;
}

// One end of the elimination.
struct HalfStrip {
  StripPivot pivot;   // of its last row
  float ratio;        // there
  float least_pivot;  // there [1/kg]
};

// Eliminates the row before from the next one. `coupling`: effect of the impulse before on this error,
// `effect_on_before`: of this impulse on the error before [1/kg]; both 0 for the first one.
HalfStrip Eliminate(HalfStrip before, vec4 row, float coupling, float effect_on_before, bool ends_at_pin) {
  float diagonal = abs(row.z);
  float min_pivot = MinPivot(ends_at_pin ? 0.0 : 1.0);
  precise float ratio = effect_on_before * before.pivot.inverse_pivot;
  precise float least_pivot = min_pivot * diagonal;
  StripPivot pivot = EliminateRow(diagonal, min_pivot, row.w, coupling, ratio, before.pivot.right_side);
  return HalfStrip(pivot, ratio, least_pivot);
}

// The impulses of the last links of both halves [N s]. The effects are those of the other's impulse.
vec2 MeetingImpulses(HalfStrip one, HalfStrip other, float effect_on_one, float effect_on_other) {
  precise float one_of_other = effect_on_one * one.pivot.inverse_pivot;
  precise float other_of_one = effect_on_other * other.pivot.inverse_pivot;
  precise float pivot = 1.0 - one_of_other * other_of_one;  // over that of either link
  precise float least_of_one = one.least_pivot * one.pivot.inverse_pivot;
  precise float least_of_other = other.least_pivot * other.pivot.inverse_pivot;
  float inverse_pivot = Quotient(1.0, max(pivot, max(least_of_one, least_of_other)));
  precise float one_alone = one.pivot.right_side - one_of_other * other.pivot.right_side;
  precise float other_alone = other.pivot.right_side - other_of_one * one.pivot.right_side;
  precise vec2 impulses = vec2(one_alone, other_alone) * inverse_pivot;
  return impulses;
}

// Replaces the right sides of the rows of a strip by its impulses. A single invocation waits for every result: both
// halves advance together, and each pass reads a row ahead.
void SolveRows(uint first, uint link_count) {
  uint of_first = LinksOfFirstHalf(first, link_count);
  uint of_second = link_count - of_first;
  HalfStrip nothing = HalfStrip(StripPivot(0.0, 0.0), 0.0, 0.0);
  HalfStrip forwards = nothing;
  HalfStrip backwards = nothing;
  uint up = first;
  uint down = first + link_count - 1u;
  vec4 row = shared_rows[up];
  vec4 row_back = shared_rows[down];
  row.x = 0.0;       // whether the strip is active
  row_back.y = 0.0;  // nothing is after the last link
  float before = 0.0;
  float after = 0.0;
  for (uint j = 0u; j < of_first; ++j) {
    vec4 next = shared_rows[up + 1u];
    vec4 next_back = shared_rows[max(down, first + 1u) - 1u];
    forwards = Eliminate(forwards, row, row.x, before, row.z < 0.0);
    HalfStrip further = Eliminate(backwards, row_back, row_back.y, after, next_back.z < 0.0);
    shared_rows[up].z = forwards.ratio;
    shared_rows[up].w = forwards.pivot.right_side;
    before = row.y;
    if (j < of_second) {
      backwards = further;
      shared_rows[down].z = further.ratio;
      shared_rows[down].w = further.pivot.right_side;
      after = row_back.x;
    }
    ++up;
    --down;
    row = next;
    row_back = next_back;
  }

  up = first + of_first - 1u;
  down = first + of_first;
  precise vec2 impulses = vec2(forwards.pivot.right_side, 0.0);
  if (of_second > 0u) impulses = MeetingImpulses(forwards, backwards, before, after);
  precise vec2 effects = vec2(forwards.ratio, backwards.ratio) * impulses;  // on the next impulses
  shared_rows[up].w = impulses.x;
  if (of_second > 0u) shared_rows[down].w = impulses.y;
  vec4 ahead = shared_rows[max(up, first + 1u) - 1u];
  vec4 ahead_back = shared_rows[down + 1u];
  for (uint j = 1u; j < of_first; ++j) {
    --up;
    ++down;
    impulses = vec2(ahead.w, ahead_back.w) - effects;
    effects = vec2(ahead.z, ahead_back.z) * impulses;
    ahead = shared_rows[max(up, first + 1u) - 1u];
    ahead_back = shared_rows[down + 1u];
    shared_rows[up].w = impulses.x;
    if (j < of_second) shared_rows[down].w = impulses.y;
  }
}

// Whether MoveRatioSq of this change is above 1, without the quotient.
bool MovesFar(vec3 change, float rest_length) {
  precise float limit = rest_length * (MAX_STRIP_MOVE * substep.inverse_interval);
  precise float limit_sq = limit * limit;
  return Dot(change, change) > limit_sq;
}

// The changes of velocity of the particles of a link, its second one and, at the first link of a strip, its first one,
// by the pulls in the rows [m/s].
struct EndChanges {
  vec3 of_to;
  vec3 of_from;
};

EndChanges ChangesOfEnds(SideLink mine) {
  vec3 pull = RowVector(mine.turn.row);
  vec3 pull_of_next = HasNext(mine.turn) ? RowVector(mine.turn.row + 1u) : vec3(0.0);
  precise vec3 of_to = InverseMass(mine.to) * (pull - pull_of_next);
  precise vec3 of_from = vec3(0.0);
  if (mine.turn.k == 0u) of_from = InverseMass(mine.from) * -pull;
  return EndChanges(of_to, of_from);
}

void ChangeVelocity(uint i, vec3 change) {
  precise vec3 velocity = Velocity(i) + change;
  if (InverseMass(i) != 0.0) SetVelocity(i, velocity);
}

void ChangeEnds(SideLink mine, EndChanges changes) {
  ChangeVelocity(mine.to, changes.of_to);
  if (mine.turn.k == 0u) ChangeVelocity(mine.from, changes.of_from);
}

void StorePull(SideLink mine, float share) {
  precise float applied = share * mine.impulse;
  AccumulateImpulse(mine.place, applied);
  precise vec3 pull = applied * mine.link.direction;
  shared_rows[mine.turn.row] = vec4(1.0, pull);  // as at the first link
}

// The impulses moved particles too far, which is rare: takes back what is too much in each strip.
void RemoveExcess(SideLink mine[kLinksPerLane]) {
  for (uint m = 0u; m < kLinksPerLane; ++m) {
    if (!mine[m].is_link) continue;
    EndChanges changes = ChangesOfEnds(mine[m]);
    float ratio_sq = max(MoveRatioSq(changes.of_to, mine[m].link.rest_length),
                         MoveRatioSq(changes.of_from, mine[m].link.rest_length));
    shared_rows[mine[m].turn.row].x = mine[m].is_active ? ratio_sq : 0.0;
  }
  PhaseBarrier();
  for (uint m = 0u; m < kLinksPerLane; ++m) {
    if (!mine[m].is_active) continue;
    float largest_ratio_sq = 0.0;
    for (uint k = 0u; k < mine[m].turn.link_count; ++k) {
      largest_ratio_sq = max(largest_ratio_sq, shared_rows[FirstRow(mine[m].turn) + k].x);
    }
    precise float back = ShareOfMove(largest_ratio_sq) - 1.0;
    mine[m].is_active = back != 0.0;
    if (mine[m].is_active) StorePull(mine[m], back);
  }
  PhaseBarrier();
  for (uint m = 0u; m < kLinksPerLane; ++m) {
    if (mine[m].is_active) ChangeEnds(mine[m], ChangesOfEnds(mine[m]));
  }
}

// The strips of a phase. In uniform control flow.
void MeetStrips(uint begin, uint end, bool is_first_sweep) {
  uint first_link = models[cloth.model.strip_offsets + begin];
  uint end_link = models[cloth.model.strip_offsets + end];
  SideLink mine[kLinksPerLane];
  for (uint m = 0u; m < kLinksPerLane; ++m) {
    uint place = first_link + gl_LocalInvocationID.x + m * uint(LOCAL_SIZE);
    mine[m] = LoadSideLink(place, end_link, is_first_sweep);
    if (mine[m].is_link) shared_rows[mine[m].turn.row] = vec4(0.0, mine[m].link.direction);
  }
  PhaseBarrier();

  vec2 effects[kLinksPerLane];
  for (uint m = 0u; m < kLinksPerLane; ++m) effects[m] = LoadNeighbours(mine[m]);
  PhaseBarrier();
  for (uint m = 0u; m < kLinksPerLane; ++m) StoreRow(mine[m], effects[m]);
  if (gl_LocalInvocationID.x == 0u) shared_has_excess = 0u;
  PhaseBarrier();

  FOR_EACH(strip, begin, end) {
    Turn turn = LoadTurn(models[cloth.model.strip_offsets + strip]);
    if (shared_rows[turn.row].x != 0.0) SolveRows(turn.row, turn.link_count);
  }
  PhaseBarrier();

  for (uint m = 0u; m < kLinksPerLane; ++m) {
    if (!mine[m].is_link) continue;
    mine[m].is_active = shared_rows[FirstRow(mine[m].turn)].x != 0.0;
    mine[m].impulse = shared_rows[mine[m].turn.row].w;
    if (mine[m].is_active) StorePull(mine[m], 1.0);
  }
  PhaseBarrier();
  for (uint m = 0u; m < kLinksPerLane; ++m) {
    if (!mine[m].is_active) continue;
    MarkChanged();
    EndChanges changes = ChangesOfEnds(mine[m]);
    ChangeEnds(mine[m], changes);
    bool moves_far = MovesFar(changes.of_to, mine[m].link.rest_length) ||
                     MovesFar(changes.of_from, mine[m].link.rest_length);
    if (moves_far) shared_has_excess = 1u;  // all writers write the same
  }
  PhaseBarrier();
  if (shared_has_excess != 0u) RemoveExcess(mine);
}
