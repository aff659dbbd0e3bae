// Numbers of the method that no client sets. Each: meaning, unit, what breaks if it is changed.
#pragma once

namespace drape {

// A particle that starts a substep inside a collider is moved out at most this fast [m/s], so that
// a cloth placed inside a collider is not shot out of it. Larger: violent ejection; smaller: slow
// recovery.
inline constexpr double kMaxDepenetrationSpeed_m_per_s = 1.0;

// A particle touches a collider when its gap is at most this share of the model's length scale [-].
// Only for counting contacts in reports.
inline constexpr double kContactMarginRatio = 1e-3;

// Beyond these a state counts as blown up and the cloth is FAULTED [m/s], [m from the cloth's
// origin]. Far above any cloth in SI units; single precision still resolves 0.1 m there.
inline constexpr double kMaxSpeed_m_per_s = 1e5;
inline constexpr double kMaxCoordinate_m = 1e6;

// Below this length [m] a difference of two positions has no direction: the impulse then acts along
// +x (distance constraints, i to j) or not at all (springs); contacts at a sphere's centre push
// along +y.
inline constexpr double kMinDirectionLength_m = 1e-12;

}  // namespace drape
