// Stage `solve_strips` by cyclic reduction: the arithmetic of one equation of a strip
// (server/solver/method.md, "solve_strips").
#ifndef DRAPE_LIB_STRIP_REDUCTION_GLSL_
#define DRAPE_LIB_STRIP_REDUCTION_GLSL_

#include "lib/roots.glsl"

// The equation of a link, divided by its pivot, in a system of every `stride`-th link:
//   impulse + before * (impulse of the link before) + after * (that of the link after) = right_side
struct StripRow {
  float before;      // [-]
  float after;       // [-]
  float right_side;  // [N s]
  float excess;      // 1 - abs(before) - abs(after) [-], kept separately: the difference would be rounding
};

vec4 PackRow(StripRow row) { return vec4(row.before, row.after, row.right_side, row.excess); }
StripRow UnpackRow(vec4 row) { return StripRow(row.x, row.y, row.z, row.w); }

// Arguments: `diagonal` [1/kg], the effects of the impulses of the links before and after on the error of this one
// [1/kg], -residual / h [m/s].
StripRow FirstRow(float diagonal, float from_before, float from_after, float right_side) {
  float inverse = Reciprocal(diagonal);
  precise float before = from_before * inverse;
  precise float after = from_after * inverse;
  precise float scaled = right_side * inverse;
  precise float excess = 1.0 - abs(before) - abs(after);
  return StripRow(before, after, scaled, excess);
}

// The same, not divided: the excess is that of the diagonal [1/kg].
StripRow UndividedRow(float diagonal, float from_before, float from_after, float right_side) {
  precise float excess = diagonal - abs(from_before) - abs(from_after);
  return StripRow(from_before, from_after, right_side, excess);
}

// A row after elimination of the one before.
struct EliminatedRow {
  float inverse_pivot;  // [-]
  float ratio;       // effect of the next impulse, over the pivot [-]
  float right_side;  // over the pivot [N s]: the impulse without the effect of the next one
};

// Eliminates the row before, whose ratio and right side are given, from one with these effects of the impulses before
// and after it. `least` is the least pivot.
EliminatedRow EliminateRow(float before, float after, float right_side, float least, float ratio_before,
                           float right_before) {
  precise float pivot = 1.0 - before * ratio_before;
  float inverse_pivot = Reciprocal(max(pivot, least));
  precise float ratio = after * inverse_pivot;
  precise float right_alone = right_side - before * right_before;
  precise float scaled = right_alone * inverse_pivot;
  return EliminatedRow(inverse_pivot, ratio, scaled);
}

struct ReducedRow {
  StripRow row;
  float inverse_pivot;  // of the previous pivot [-]
};

// Eliminates from an equation the link before and, if `has_after`, the one after; otherwise the term of the link
// after stays. `least` is the least pivot. If all impulses act along the directions at the end, every sum for the
// pivot has no negative term.
ReducedRow ReduceRow(StripRow row, StripRow row_before, StripRow row_after, bool has_after,
                     float least) {
  float share_after = has_after ? row.after : 0.0;
  precise float before = -(row.before * row_before.before);
  precise float after = has_after ? -(row.after * row_after.after) : row.after;
  precise float excess = row.excess + abs(row.before) * row_before.excess;
  excess = excess + abs(share_after) * row_after.excess;
#ifdef HAS_START_DIRECTIONS
  // The effects of two links on each other are not equal there and may have unequal signs.
  precise float unlike_before = max(-(row.before * row_before.after), 0.0);
  precise float unlike_after = max(-(share_after * row_after.before), 0.0);
  excess = excess + 2.0 * (unlike_before + unlike_after);
#endif
  precise float pivot = excess + (abs(before) + abs(after));
  precise float raised = max(pivot, least);
  float inverse = Reciprocal(raised);
  precise float right_side = row.right_side - row.before * row_before.right_side;
  right_side = right_side - share_after * row_after.right_side;
  precise float scaled_before = before * inverse;
  precise float scaled_after = after * inverse;
  precise float scaled_right_side = right_side * inverse;
  precise float scaled_excess = (excess + (raised - pivot)) * inverse;
  return ReducedRow(StripRow(scaled_before, scaled_after, scaled_right_side, scaled_excess),
                    inverse);
}

// A row that is not divided, over its diagonal.
ReducedRow DivideRow(StripRow row, float diagonal) {
  float inverse = Reciprocal(diagonal);
  precise float before = row.before * inverse;
  precise float after = row.after * inverse;
  precise float right_side = row.right_side * inverse;
  precise float excess = row.excess * inverse;
  return ReducedRow(StripRow(before, after, right_side, excess), inverse);
}

// ReduceRow by the link before alone; the term of the link after stays.
ReducedRow ReduceBefore(StripRow row, StripRow row_before, float least) {
  precise float before = -(row.before * row_before.before);
  precise float excess = row.excess + abs(row.before) * row_before.excess;
#ifdef HAS_START_DIRECTIONS
  precise float unlike = max(-(row.before * row_before.after), 0.0);
  excess = excess + 2.0 * unlike;
#endif
  precise float pivot = excess + (abs(before) + abs(row.after));
  precise float raised = max(pivot, least);
  float inverse = Reciprocal(raised);
  precise float right_side = row.right_side - row.before * row_before.right_side;
  precise float scaled_before = before * inverse;
  precise float scaled_after = row.after * inverse;
  precise float scaled_right_side = right_side * inverse;
  precise float scaled_excess = (excess + (raised - pivot)) * inverse;
  return ReducedRow(StripRow(scaled_before, scaled_after, scaled_right_side, scaled_excess), inverse);
}

// Eliminates the link after from a row, where that has no term of this one: both have one of the same link before. The
// pivot stays.
StripRow ReduceAfter(StripRow row, StripRow row_after) {
  precise float added = row.after * row_after.before;
  precise float before = row.before - added;
  precise float after = -(row.after * row_after.after);
  precise float right_side = row.right_side - row.after * row_after.right_side;
  precise float excess = row.excess + abs(row.after) * row_after.excess;
#ifdef HAS_START_DIRECTIONS
  // The sum of terms of unlike signs is smaller.
  precise float unlike = row.before * added > 0.0 ? min(abs(row.before), abs(added)) : 0.0;
  excess = excess + 2.0 * unlike;
#endif
  return StripRow(before, after, right_side, excess);
}

#endif
