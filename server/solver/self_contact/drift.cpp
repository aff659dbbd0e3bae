#include "server/solver/self_contact/drift.h"

#include <cmath>
#include <cstddef>
#include <limits>
#include <type_traits>

namespace drape::self_contact {
namespace {

// The box of some drifts, and their sum, which is not finite if any of them is not: comparisons
// leave out what is no number.
template <class V>
struct Drifts {
  Box<V> box;
  V sum{};

  void Add(const V& drift) {
    box.Add(drift);
    sum += drift;
  }
  void Add(const Drifts& other) {
    box.Add(other.box);
    sum += other.sum;
  }
};

// Of particles from `first` on.
template <class V>
Drifts<V> DriftsFrom(size_t first, const V* p, const V* q, const V* v, size_t count,
                     ScalarOf<V> time) {
  // Two at a time: each waits for the one before.
  Drifts<V> drifts, others;
  const auto drift_of = [&](size_t i) { return V((p[i] - q[i]) - time * v[i]); };
  for (; first + 1 < count; first += 2) {
    drifts.Add(drift_of(first));
    others.Add(drift_of(first + 1));
  }
  if (first < count) drifts.Add(drift_of(first));
  drifts.Add(others);
  return drifts;
}

#ifdef __x86_64__

// Two particles side by side. Minimum, maximum, difference and product are rounded as those of
// Vector3f are; fused multiply and add is not among what is asked for here.
using Wide = float __attribute__((vector_size(32), aligned(16), may_alias));

__attribute__((target("avx2"))) Drifts<Vector3f> DriftsOfPairs(const Vector3f* p, const Vector3f* q,
                                                               const Vector3f* v, size_t pairs,
                                                               float time) {
  const auto* const wide_p = reinterpret_cast<const Wide*>(p);
  const auto* const wide_q = reinterpret_cast<const Wide*>(q);
  const auto* const wide_v = reinterpret_cast<const Wide*>(v);
  constexpr float kMost = std::numeric_limits<float>::max();
  const Wide zero = {};
  Wide low = zero + kMost, high = zero - kMost, sum = zero;
  Wide other_low = low, other_high = high, other_sum = zero;
  size_t k = 0;
  for (; k + 1 < pairs; k += 2) {
    const Wide drift = (wide_p[k] - wide_q[k]) - time * wide_v[k];
    const Wide other = (wide_p[k + 1] - wide_q[k + 1]) - time * wide_v[k + 1];
    low = low < drift ? low : drift;
    high = high > drift ? high : drift;
    other_low = other_low < other ? other_low : other;
    other_high = other_high > other ? other_high : other;
    sum += drift;
    other_sum += other;
  }
  if (k < pairs) {
    const Wide drift = (wide_p[k] - wide_q[k]) - time * wide_v[k];
    low = low < drift ? low : drift;
    high = high > drift ? high : drift;
    sum += drift;
  }
  low = low < other_low ? low : other_low;
  high = high > other_high ? high : other_high;
  sum += other_sum;
  Drifts<Vector3f> drifts;
  drifts.box.Add(Vector3f{low[0], low[1], low[2], 0});
  drifts.box.Add(Vector3f{low[4], low[5], low[6], 0});
  drifts.box.Add(Vector3f{high[0], high[1], high[2], 0});
  drifts.box.Add(Vector3f{high[4], high[5], high[6], 0});
  drifts.sum = Vector3f{sum[0] + sum[4], sum[1] + sum[5], sum[2] + sum[6], 0};
  return drifts;
}

#endif

template <class V>
Drifts<V> DriftsOf(const V* p, const V* q, const V* v, size_t count, ScalarOf<V> time) {
#ifdef __x86_64__
  if constexpr (std::is_same_v<V, Vector3f>) {
    if (count >= 2 && __builtin_cpu_supports("avx2")) {
      const size_t pairs = count / 2;
      Drifts<V> drifts = DriftsOfPairs(p, q, v, pairs, time);
      drifts.Add(DriftsFrom(2 * pairs, p, q, v, count, time));
      return drifts;
    }
  }
#endif
  return DriftsFrom(0, p, q, v, count, time);
}

}  // namespace

template <class V>
ScalarOf<V> DriftOf(std::span<const V> positions, std::span<const V> found_positions,
                    std::span<const V> found_velocities, ScalarOf<V> time) {
  const Drifts<V> drifts = DriftsOf<V>(positions.data(), found_positions.data(),
                                       found_velocities.data(), found_positions.size(), time);
  const V& sum = drifts.sum;
  if (!std::isfinite(sum[0] + sum[1] + sum[2])) {
    return std::numeric_limits<ScalarOf<V>>::infinity();
  }
  return Length(V(drifts.box.high - drifts.box.low));
}

template float DriftOf<Vector3f>(std::span<const Vector3f>, std::span<const Vector3f>,
                                 std::span<const Vector3f>, float);
template double DriftOf<Vector3d>(std::span<const Vector3d>, std::span<const Vector3d>,
                                  std::span<const Vector3d>, double);

}  // namespace drape::self_contact
