// Coulomb's law of one pair of a cloth (server/solver/method.md, solve_self_contacts). Pure.
#pragma once

#include <algorithm>

#include "server/solver/self_contact/contact_pair.h"
#include "shaders/interface/self_contact_search.h"

namespace drape::self_contact {

// Of a pair of one cloth.
template <class Real>
struct FrictionNumbers {
  Real statics = 0, dynamics = 0;
};

// Whether what slides at `speed` [m/s] has the dynamic friction, where each substep presses by
// `push` [m/s].
template <class Real>
inline bool Slips(const FrictionNumbers<Real>& friction, Real speed, Real push) {
  return speed > static_cast<Real>(DRAPE_CONTACT_SLIP_SUBSTEPS) * friction.statics * push;
}

// The impulse across the normal nearest to the one that stops the sliding.
template <class V>
inline V Friction(const FrictionNumbers<ScalarOf<V>>& friction, bool slips, const V& stopping,
                  ScalarOf<V> push) {
  const ScalarOf<V> limit = (slips ? friction.dynamics : friction.statics) * push;
  const ScalarOf<V> size = Length(stopping);
  return size <= limit ? stopping : V(stopping * (limit / size));
}

}  // namespace drape::self_contact
