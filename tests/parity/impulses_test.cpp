// Impulses of every backend against the reference, one by one: their sum is the
// business of tests/physics/impulses_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>

#include "tests/support/backends/backends.h"
#include "tests/support/constraint_scenes.h"
#include "tests/support/scenes.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

std::shared_ptr<const StepImpulses> ImpulsesOf(Backend& backend, const Scene& scene) {
  const ClothHandle cloth = CreateCloth(backend, scene);
  const StepItem item{.cloth = cloth,
                      .pin_targets_m = scene.pin_targets_m,
                      .grips = scene.grips,
                      .impulses = true,
                      .contact_impulses = true};
  const auto impulses = backend.Step({&item, 1}).reports.at(0).impulses;
  backend.Destroy(cloth);
  return impulses;
}

std::vector<Vector3d> VectorsOf(const StepImpulses& impulses) {
  std::vector<Vector3d> vectors = impulses.pins_n_s;
  vectors.insert(vectors.end(), impulses.grips_n_s.begin(), impulses.grips_n_s.end());
  for (const ColliderImpulse& collider : impulses.colliders) {
    vectors.push_back(collider.impulse_n_s);
    vectors.push_back(collider.angular_impulse_n_m_s);
  }
  return vectors;
}

using Contact = std::pair<uint32_t, uint32_t>;  // particle and collider
std::map<Contact, Vector3d> ContactsOf(const StepImpulses& impulses) {
  std::map<Contact, Vector3d> contacts;
  for (const ParticleImpulse& contact : *impulses.contacts) {
    contacts.emplace(Contact(contact.particle, contact.collider), contact.impulse_n_s);
  }
  return contacts;
}

class ImpulseParityTest : public testing::TestWithParam<std::string> {
 protected:
  // Few substeps, so that rounding has not grown: an impulse is off by some roundings of the
  // velocities and positions behind it, over the interval of a substep, times the mass it moves.
  void ExpectParity(Scene scene) {
    SCOPED_TRACE(scene.name);
    scene.parameters.settings.substeps = 4;
    scene.parameters.settings.tolerance = 0;
    Backend& backend = SharedBackend(GetParam());
    const auto actual = ImpulsesOf(backend, scene);
    const auto expected = ImpulsesOf(SharedBackend("reference"), scene);
    ASSERT_TRUE(actual != nullptr && expected != nullptr);
    const std::vector<Vector3d> vectors = VectorsOf(*actual), others = VectorsOf(*expected);
    ASSERT_EQ(vectors.size(), others.size());
    double mass_kg = 0, extent_m = 1;
    for (const double m : scene.model->masses_kg()) mass_kg += m;
    for (const Vector3d& p : scene.state.positions_m) extent_m = std::max(extent_m, p.norm());
    double size = 0;
    for (const Vector3d& impulse : others) size = std::max(size, impulse.norm());
    const double h = scene.parameters.settings.substep_s();
    const double bound = 64 * UnitRoundOff(backend) * (size + mass_kg * extent_m / h);
    for (size_t k = 0; k < vectors.size(); ++k) {
      EXPECT_LE((vectors[k] - others[k]).norm(), bound)
          << k << ": " << vectors[k].transpose() << " instead of " << others[k].transpose();
    }
    EXPECT_LT(bound, 0.1 * size) << "a bound that says nothing";
    ASSERT_TRUE(actual->contacts && expected->contacts);
    // What touches in one precision alone does so by rounding.
    std::map<Contact, Vector3d> differences = ContactsOf(*actual);
    for (const auto& [contact, impulse] : ContactsOf(*expected)) {
      differences.try_emplace(contact, Vector3d::Zero()).first->second -= impulse;
    }
    for (const auto& [contact, difference] : differences) {
      EXPECT_LE(difference.norm(), bound) << contact.first << " at " << contact.second;
    }
  }
};
class StripImpulseParityTest : public ImpulseParityTest {};
INSTANTIATE_TEST_SUITE_P(Backends, StripImpulseParityTest, testing::ValuesIn(StripBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);
INSTANTIATE_TEST_SUITE_P(Backends, ImpulseParityTest, testing::ValuesIn(FloatBackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// Moves the pins so that they jerk.
Scene Jerked(Scene scene) {
  for (const uint32_t pin : scene.model->pins()) {
    scene.pin_targets_m.push_back(scene.state.positions_m[pin] + Vector3d(0.01, 0.02, -0.03));
  }
  return scene;
}

TEST_P(ImpulseParityTest, OfEverythingThatPulls) {
  for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
    std::vector<Scene> scenes = {Grid(11, 9, 0.5, 0.4, {0, 4, 10, 60}),
                                 Grid(11, 9, 0.5, 0.4, {0, 4, 10, 60}),
                                 Grid(12, 9, 0.5, 0.4, {0, 1, 11, 40, 41},
                                      {.bending_rigidity_n_m = 1e-2, .shear_modulus_n_per_m = 200}),
                                 Grid(12, 9, 0.5, 0.4, {0, 1, 11, 40, 41},
                                      {.bending_rigidity_n_m = 20, .shear_modulus_n_per_m = 2e5}),
                                 MeshedGrid(9, 9, 1, 1, {0, 1, 40}, {.bending_rigidity_n_m = 1e-2}),
                                 MeshedGrid(9, 9, 1, 1, {0, 1, 40}, {.bending_rigidity_n_m = 1}),
                                 CompliantSheet(12, 1e-4),
                                 Net(6, 0.1, 1e-4),
                                 RopesAndStruts(5, 0.1, 1e-4),
                                 JointedChain(6, 0.1, 1e-3)};
    scenes[1].parameters.settings.sweep = Sweep::kColours;
    scenes[1].parameters.settings.velocity_iterations = 2;
    for (Scene& scene : scenes) {
      scene.parameters.settings.integration = integration;
      scene.parameters.settings.twist_damping_per_s = 150;
      scene.parameters.air_drag = 1.2;
      scene.parameters.wind_m_per_s = {3, 1, 2};
      Stir(scene, 0.5);
      ExpectParity(Jerked(scene));
    }
  }
}

// By every way to solve strips, in both plans of gl.
TEST_P(StripImpulseParityTest, OfStripsThatMeetPinsAndGrips) {
  for (Scene scene :
       {Grid(11, 9, 0.5, 0.4, {0, 4, 10, 60}), Grid(34, 32, 1.7, 1.6, {0, 33, 500})}) {
    Stir(scene, 0.5);
    GripParticles(scene, {7, 40}, {0.01, -0.02, 0});
    ExpectParity(Jerked(scene));
  }
}

// Those that are too large for the resident plan of gl.
TEST_P(ImpulseParityTest, OfLargeCloths) {
  std::vector<Scene> scenes = {FallingOnSphere(34),
                               Grid(34, 32, 1.7, 1.6, {0, 1, 33, 40, 500},
                                    {.bending_rigidity_n_m = 20, .shear_modulus_n_per_m = 2e5}),
                               MeshedGrid(33, 33, 1, 1, {0, 1, 40}, {.bending_rigidity_n_m = 1e-3}),
                               CompliantSheet(33, 1e-4), RopesAndStruts(33, 0.02, 1e-4)};
  for (Vector3d& v : scenes[0].state.velocities_m_per_s) v.y() = -4;
  GripParticles(scenes[0], {0, 77, 1143}, {0, -0.02, 0});
  scenes[3].parameters.settings.velocity_iterations = 2;
  scenes[3].parameters.settings.integration = Integration::kOneStep;
  for (size_t k = 1; k < scenes.size(); ++k) {
    scenes[k].parameters.air_drag = 1.2;
    scenes[k].parameters.settings.twist_damping_per_s = 150;
    Stir(scenes[k], 0.5);
    scenes[k] = Jerked(scenes[k]);
  }
  for (const Scene& scene : scenes) ExpectParity(scene);
}

TEST_P(ImpulseParityTest, OfCollidersAndGrips) {
  for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
    for (Scene scene : {FallingOnSphere(12), FallingOnBoxAndCapsule(12)}) {
      scene.parameters.settings.integration = integration;
      for (Vector3d& v : scene.state.velocities_m_per_s) v.y() = -4;
      GripParticles(scene, {0, 77, 143}, {0, -0.02, 0});
      ExpectParity(scene);
    }
  }
}

}  // namespace
}  // namespace drape::test
