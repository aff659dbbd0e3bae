#include "tests/support/constraint_scenes.h"

namespace drape::test {

Scene JointedChain(uint32_t links, double link_m, double joint_compliance_m_per_n) {
  ParticleTopology particles;
  for (uint32_t link = 0; link < links; ++link) {
    const uint32_t i = 2 * link;
    for (const double end : {0.0, 1.0}) {
      particles.positions_m.emplace_back(link_m * (link + end), 0, 0);
      particles.masses_kg.push_back(0.01 * (1 + (i + static_cast<uint32_t>(end)) % 3));
    }
    particles.distance_constraints.push_back({i, i + 1, link_m, 0});
    if (link > 0) particles.point_joints.push_back({i - 1, i, joint_compliance_m_per_n});
  }
  Scene scene = Particles(particles, {0});
  scene.name = "jointed_chain_" + std::to_string(links);
  return scene;
}

Scene RopesAndStruts(uint32_t side, double cord_m, double compliance_m_per_n) {
  constexpr ConstraintKind kKinds[] = {ConstraintKind::kEqual, ConstraintKind::kAtMost,
                                       ConstraintKind::kAtLeast};
  const Scene net = Net(side, cord_m, compliance_m_per_n);
  ParticleTopology particles;
  particles.positions_m = net.state.positions_m;
  particles.masses_kg.assign(net.model->masses_kg().begin(), net.model->masses_kg().end());
  for (const DistanceConstraint& constraint : net.model->constraints()) {
    particles.distance_constraints.push_back(constraint);
    particles.distance_constraints.back().kind = kKinds[particles.distance_constraints.size() % 3];
  }
  Scene scene = Particles(particles, {0, side - 1, side * (side - 1), side * side - 1});
  scene.name = "ropes_and_struts_" + std::to_string(side);
  return scene;
}

std::vector<double> UnevenLengths(const SceneModel& model, double amplitude) {
  std::vector<double> lengths_m;
  for (uint32_t k = 0; k < model.constraint_count(); ++k) {
    const double share = static_cast<double>(model.constraint_sources()[k] % 5) / 2 - 1;
    lengths_m.push_back(model.constraints()[k].rest_length_m * (1 + amplitude * share));
  }
  return lengths_m;
}

}  // namespace drape::test
