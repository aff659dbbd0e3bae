// The nearest points of a vertex and a triangle, and of two edges
// (server/solver/self_contact/closest_points.h).
#ifndef DRAPE_LIB_CLOSEST_POINTS_GLSL_
#define DRAPE_LIB_CLOSEST_POINTS_GLSL_

#include "lib/vector.glsl"

// The corners of two primitives: a vertex and a triangle, or two edges.
struct Corners {
  vec3 a, b, c, d;
};

// `difference` is the sum of weights times corners, from the nearest point of the second primitive to that of the
// first one; the weights of the first add up to 1, those of the second to -1.
struct ClosestPoints {
  vec4 weights;
  vec3 difference;
};

// The smallest normal number; a share of products of squared lengths [-].
const float kTinySquare = 1.17549435e-38;
const float kParallelShare = 1.9073486e-6;

// Of edges a b and c d (Ericson 2005, «Real-Time Collision Detection», section 5.1.9).
ClosestPoints ClosestOfEdges(Corners p) {
  precise vec3 d1 = p.b - p.a;
  precise vec3 d2 = p.d - p.c;
  precise vec3 r = p.a - p.c;
  precise float a = Dot(d1, d1) + kTinySquare;
  precise float e = Dot(d2, d2) + kTinySquare;
  float b = Dot(d1, d2);
  float c = Dot(d1, r);
  float f = Dot(d2, r);
  precise float denominator = a * e - b * b;
  // Nearly parallel edges: any point of the first is as good, up to the ends.
  precise float least = kParallelShare * a * e;
  precise float numerator = b * f - c * e;
  float s = denominator > least ? clamp(Quotient(numerator, denominator), 0.0, 1.0) : 0.5;
  precise float along_second = b * s + f;
  float t = clamp(Quotient(along_second, e), 0.0, 1.0);
  precise float along_first = b * t - c;
  s = clamp(Quotient(along_first, a), 0.0, 1.0);
  precise vec3 difference = (r + s * d1) - t * d2;
  precise vec4 weights = vec4(1.0 - s, s, t - 1.0, -t);
  return ClosestPoints(weights, difference);
}

// Of vertex a and triangle b c d (Ericson 2005, section 5.1.5).
ClosestPoints ClosestOfVertex(Corners p) {
  precise vec3 ab = p.c - p.b;
  precise vec3 ac = p.d - p.b;
  precise vec3 ap = p.a - p.b;
  precise vec3 bp = p.a - p.c;
  precise vec3 cp = p.a - p.d;
  float d1 = Dot(ab, ap);
  float d2 = Dot(ac, ap);
  float d3 = Dot(ab, bp);
  float d4 = Dot(ac, bp);
  float d5 = Dot(ab, cp);
  float d6 = Dot(ac, cp);
  precise float vc = d1 * d4 - d3 * d2;
  precise float vb = d5 * d2 - d1 * d6;
  precise float va = d3 * d6 - d5 * d4;
  float v = 0.0;
  float w = 0.0;
  if (d1 <= 0.0 && d2 <= 0.0) {
    v = 0.0;
  } else if (d3 >= 0.0 && d4 <= d3) {
    v = 1.0;
  } else if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    precise float length = d1 - d3;
    v = Quotient(d1, length);
  } else if (d6 >= 0.0 && d5 <= d6) {
    w = 1.0;
  } else if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    precise float length = d2 - d6;
    w = Quotient(d2, length);
  } else if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    precise float from_c = d4 - d3;
    precise float length = from_c + (d5 - d6);
    w = Quotient(from_c, length);
    precise float rest = 1.0 - w;
    v = rest;
  } else {
    precise float total = va + vb + vc;
    v = total > 0.0 ? Quotient(vb, total) : 0.0;
    w = total > 0.0 ? Quotient(vc, total) : 0.0;
  }
  precise vec3 difference = (ap - v * ab) - w * ac;
  precise float first = v + w - 1.0;
  return ClosestPoints(vec4(1.0, first, -v, -w), difference);
}

ClosestPoints Closest(bool are_edges, Corners p) {
  if (are_edges) return ClosestOfEdges(p);
  return ClosestOfVertex(p);
}

// How far the first primitive is from the second along n: from its lowest corner to the highest one of the other,
// negative where they overlap. Differences of corners keep their digits far from the origin.
float GapAlong(bool are_edges, Corners p, vec3 n) {
  precise vec3 to_b = p.b - p.a;
  precise vec3 to_c = p.c - p.a;
  precise vec3 to_d = p.d - p.a;
  float b = Dot(n, to_b);
  float c = Dot(n, to_c);
  float d = Dot(n, to_d);
  if (!are_edges) return -max(max(b, c), d);
  precise float gap = min(0.0, b) - max(c, d);
  return gap;
}

// The direction across both edges, or that of the triangle's normal, that points from the second primitive to the
// first; 0 if there is none.
vec3 DirectionAcross(bool are_edges, Corners p, vec3 difference) {
  precise vec3 first = are_edges ? p.b - p.a : p.c - p.b;
  precise vec3 second = are_edges ? p.d - p.c : p.d - p.b;
  vec3 normal = Cross(first, second);
  float length = Length(normal);
  if (!(length > 0.0)) return vec3(0.0);
  vec3 unit = Quotient(normal, length);
  return Dot(normal, difference) >= 0.0 ? unit : -unit;
}

// The ranges of the corners of each primitive, or of vectors at them.
struct CornerRanges {
  vec3 first_low, first_high, second_low, second_high;
};

CornerRanges RangesOf(bool are_edges, Corners v) {
  vec3 first_low = are_edges ? min(v.a, v.b) : v.a;
  vec3 first_high = are_edges ? max(v.a, v.b) : v.a;
  vec3 second_low = are_edges ? min(v.c, v.d) : min(min(v.b, v.c), v.d);
  vec3 second_high = are_edges ? max(v.c, v.d) : max(max(v.b, v.c), v.d);
  return CornerRanges(first_low, first_high, second_low, second_high);
}

// Per axis, the largest difference of a vector of the first primitive and one of the second.
vec3 LargestDifferences(bool are_edges, Corners v) {
  CornerRanges r = RangesOf(are_edges, v);
  precise vec3 above = r.first_high - r.second_low;
  precise vec3 below = r.second_high - r.first_low;
  return max(abs(above), abs(below));
}

// The boxes around both primitives are so far apart [m].
float BoxGap(bool are_edges, Corners p) {
  CornerRanges r = RangesOf(are_edges, p);
  precise vec3 above = r.first_low - r.second_high;
  precise vec3 below = r.second_low - r.first_high;
  return Length(max(max(above, below), vec3(0.0)));
}

#endif
