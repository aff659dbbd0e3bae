// Small cloths with joints, ropes and struts.
#pragma once

#include <cstdint>

#include "tests/support/scenes.h"

namespace drape::test {

// Rods of link_m along +x, each a pair of particles of its own, the end of one joined to the begin
// of the next; the first particle pinned. Masses differ from rod to rod. 2 * links particles.
Scene JointedChain(uint32_t links, double link_m, double joint_compliance_m_per_n);

// The net of scenes.h whose cords are in turn equalities, ropes and struts.
Scene RopesAndStruts(uint32_t side, double cord_m, double compliance_m_per_n);

// Rest lengths of the model times 1 + amplitude * (-1 .. 1 by turns).
std::vector<double> UnevenLengths(const SceneModel& model, double amplitude);

}  // namespace drape::test
