// What contacts give to each particle in a step (server/solver/method.md, "Impulses"): of a
// collider they add up to what it got, of cloth to nothing, and with the weight they are what
// changes the momentum of a cloth that nothing holds.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include "tests/physics/body_scene.h"
#include "tests/physics/physics_test.h"
#include "tests/physics/touching.h"
#include "tests/support/worlds/worlds.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;
constexpr double kG = 9.81;
constexpr uint32_t kCloth = ParticleImpulse::kCloth;

StepItem Asking(ClothHandle cloth, const Scene& scene) {
  return {.cloth = cloth,
          .pin_targets_m = scene.pin_targets_m,
          .grips = scene.grips,
          .impulses = true,
          .contact_impulses = true};
}

// Throws if there are none: the end of the test alone, not of all others.
const StepImpulses& ImpulsesOf(const StepReport& report) {
  if (report.impulses == nullptr || !report.impulses->contacts) {
    throw std::runtime_error("no contacts");
  }
  return *report.impulses;
}

Vector3d SumBy(const StepImpulses& impulses, uint32_t collider) {
  Vector3d sum = Vector3d::Zero();
  for (const ParticleImpulse& contact : *impulses.contacts) {
    if (contact.collider == collider) sum += contact.impulse_n_s;
  }
  return sum;
}

Vector3d SumOf(const StepImpulses& impulses) {
  Vector3d sum = Vector3d::Zero();
  for (const ParticleImpulse& contact : *impulses.contacts) sum += contact.impulse_n_s;
  return sum;
}

// However they cancel [N s].
double SizeOf(const StepImpulses& impulses) {
  double size = 0;
  for (const ParticleImpulse& contact : *impulses.contacts) size += contact.impulse_n_s.norm();
  return size;
}

double MassOf(const Scene& scene) {
  double mass_kg = 0;
  for (const double m : scene.model->masses_kg()) mass_kg += m;
  return mass_kg;
}

Vector3d MomentumOf(const Scene& scene, const ParticleState& state) {
  Vector3d momentum = Vector3d::Zero();
  for (size_t i = 0; i < state.velocities_m_per_s.size(); ++i) {
    momentum += scene.model->masses_kg()[i] * state.velocities_m_per_s[i];
  }
  return momentum;
}

double LargestSpeed(const ParticleState& state) {
  double speed = 0;
  for (const Vector3d& v : state.velocities_m_per_s) speed = std::max(speed, v.norm());
  return speed;
}

void ExpectOrder(const StepImpulses& impulses, const Scene& scene) {
  const auto place = [](const ParticleImpulse& contact) {
    return std::tuple(contact.particle, contact.collider);
  };
  const std::vector<ParticleImpulse>& contacts = *impulses.contacts;
  for (size_t k = 0; k < contacts.size(); ++k) {
    EXPECT_FALSE(contacts[k].impulse_n_s.isZero(0));
    EXPECT_LT(contacts[k].particle, scene.model->particle_count());
    if (contacts[k].collider != kCloth) {
      EXPECT_LT(contacts[k].collider, scene.parameters.colliders.size());
    }
    if (k > 0) {
      EXPECT_LT(place(contacts[k - 1]), place(contacts[k]));
    }
  }
}

class ContactImpulses : public PhysicsTest {
 protected:
  StepReport Step(ClothHandle cloth, const Scene& scene) {
    const StepItem item = Asking(cloth, scene);
    return backend().Step({&item, 1}).reports.at(0);
  }

  // Each collider got the opposite of what the particles got from it. A sum of n numbers in single
  // precision per particle and substep is off by a rounding of their size for each addition; as
  // many for the sums of the collider, which gl adds up in single precision, too.
  void ExpectOppositeOfColliders(const Scene& scene, const StepImpulses& impulses) {
    const double additions =
        scene.parameters.settings.substeps * (2.0 * scene.parameters.settings.max_iterations + 3);
    const double bound = 2 * round_off() * additions * SizeOf(impulses);
    for (uint32_t c = 0; c < impulses.colliders.size(); ++c) {
      EXPECT_LE((SumBy(impulses, c) + impulses.colliders[c].impulse_n_s).norm(), bound) << c;
    }
    if (SizeOf(impulses) > 0) {
      EXPECT_LT(bound, 0.01 * SizeOf(impulses)) << "a bound that says nothing";
    }
  }

  void ExpectOpposite(Scene scene, uint32_t steps) {
    SCOPED_TRACE(scene.name);
    const ClothHandle cloth = Make(scene);
    double touched = 0;
    for (uint32_t step = 0; step < steps; ++step) {
      const StepReport report = Step(cloth, scene);
      ASSERT_EQ(report.fault, FaultReason::kNone);
      const StepImpulses& impulses = ImpulsesOf(report);
      ExpectOrder(impulses, scene);
      ExpectOppositeOfColliders(scene, impulses);
      touched = std::max(touched, SizeOf(impulses));
    }
    EXPECT_GT(touched, 0) << "nothing touched";
  }

  void ExpectBalanceOfAFold(uint32_t steps);
};
INSTANTIATE_TEST_SUITE_P(Backends, ContactImpulses, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

TEST_P(ContactImpulses, OfAColliderAreTheOppositeOfItsImpulse) {
  for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
    for (Scene scene : {FallingOnSphere(12), FallingOnBoxAndCapsule(12)}) {
      scene.parameters.settings.integration = integration;
      for (Vector3d& v : scene.state.velocities_m_per_s) v.y() = -2.5;
      GripParticles(scene, {0, 77, 143}, {0, -0.02, 0});
      ExpectOpposite(scene, 6);
    }
  }
}

TEST_P(ContactImpulses, OfEdgesAndTrianglesToo) {
  Scene scene = FallingOnBoxAndCapsule(8);
  scene.parameters.settings.collider_contact = ColliderContact::kSurface;
  for (Vector3d& v : scene.state.velocities_m_per_s) v.y() = -2.5;
  GripParticles(scene, {0, 63}, {0, -0.02, 0});
  ExpectOpposite(scene, 6);
}

TEST_P(ContactImpulses, OfABallAreTheOppositeOfItsImpulse) {
  // One in a sheet that is held by its corners, one that presses a sheet onto a floor.
  Scene caught = Grid(9, 9, 0.4, 0.4, {0, 8, 72, 80});
  AddBody(caught, Ball({0.21, 0.06, 0.19}, 0.05, 0.05), {0, -1, 0});
  ExpectOpposite(caught, 8);
  Scene pressed = Grid(9, 9, 0.4, 0.4);
  pressed.parameters.friction_static = pressed.parameters.friction_dynamic = 0.4;
  AddBody(pressed, PlaneThrough({0, -0.001, 0}, {0, 1, 0}));
  AddBody(pressed, Ball({0.21, 0.06, 0.19}, 0.05, 0.05));
  const ClothHandle cloth = Make(pressed);
  for (uint32_t step = 0; step < 30; ++step) {
    const StepReport report = Step(cloth, pressed);
    const StepImpulses& impulses = ImpulsesOf(report);
    ExpectOrder(impulses, pressed);
    // What the cloth gave to the ball, which touches nothing else.
    EXPECT_LE((SumBy(impulses, 1) + impulses.colliders[1].impulse_n_s).norm(),
              1e-12 + 1e-9 * SizeOf(impulses));
  }
}

// Every particle carries its own weight, however it is damped.
TEST_P(ContactImpulses, OfASheetThatLiesAreItsWeight) {
  Scene scene = Grid(9, 9, 0.4, 0.4);
  scene.parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0})};
  scene.parameters.settings = PresetSettings(Preset::kRealtime);
  const ClothHandle cloth = Make(scene);
  StepAlone(backend(), cloth, scene);
  const StepReport report = Step(cloth, scene);
  const StepImpulses& impulses = ImpulsesOf(report);
  ASSERT_EQ(impulses.contacts->size(), 81u);
  for (const ParticleImpulse& contact : *impulses.contacts) {
    const double weight =
        scene.model->masses_kg()[contact.particle] * kG * scene.parameters.settings.time_step_s;
    EXPECT_EQ(contact.collider, 0u);
    // It stays where it is, to rounding of its place and velocity in each substep.
    EXPECT_NEAR(contact.impulse_n_s.y(), weight, 1e-4 * weight) << contact.particle;
    EXPECT_LE(contact.impulse_n_s.cross(Vector3d::UnitY()).norm(), 1e-4 * weight);
  }
}

// A sheet whose halves fall onto each other and onto a floor: the weight and the contacts are all
// that changes its momentum, and what it gives to itself adds up to nothing.
void ContactImpulses::ExpectBalanceOfAFold(uint32_t steps) {
  for (const Integration integration : {Integration::kOneStep, Integration::kTwoStep}) {
    // Its kernels take a minute to compile.
    if (backend_name() == "gl" && integration == Integration::kOneStep) continue;
    Scene scene = Grid(10, 17, 0.2, 0.34);
    scene.name = integration == Integration::kOneStep ? "fold_one" : "fold_two";
    scene.parameters.settings.integration = integration;
    scene.parameters.settings.substeps = 20;
    scene.parameters.colliders = {PlaneThrough({0, -0.004, 0}, {0, 1, 0})};
    scene.parameters.self_collision =
        SelfCollision{.thickness_m = 0.004, .friction_static = {}, .friction_dynamic = {}};
    scene.parameters.friction_static = scene.parameters.friction_dynamic = 0.3;
    for (uint32_t i = 0; i < 170; ++i) {
      Vector3d& p = scene.state.positions_m[i];
      const double from_middle = p.z() - 0.17;
      p = {p.x(), from_middle > 0 ? 0.0 : 0.006, 0.17 - std::abs(from_middle)};
      scene.state.velocities_m_per_s[i].y() = from_middle < -0.01 ? -1.5 : 0;
    }
    const ClothHandle cloth = Make(scene), plain = Make(scene);
    ParticleState before = ReadState(backend(), cloth);
    double touched = 0;
    for (uint32_t step = 0; step < steps; ++step) {
      const StepReport report = Step(cloth, scene);
      ASSERT_EQ(report.fault, FaultReason::kNone);
      // By the same kernels.
      StepItem without = Asking(plain, scene);
      without.contact_impulses = false;
      backend().Step({&without, 1});
      ASSERT_TRUE(ReadBits(backend(), cloth) == ReadBits(backend(), plain)) << "step " << step;
      const StepImpulses& impulses = ImpulsesOf(report);
      ExpectOrder(impulses, scene);
      const ParticleState after = ReadState(backend(), cloth);
      const double mass_kg = MassOf(scene);
      const double dt = scene.parameters.settings.time_step_s;
      const Vector3d change = MomentumOf(scene, after) - MomentumOf(scene, before);
      const Vector3d left = change - SumOf(impulses) - mass_kg * dt * Vector3d(0, -kG, 0);
      const double scale =
          mass_kg * (LargestSpeed(before) + LargestSpeed(after) + kG * dt) + SizeOf(impulses);
      // As the bound of Balance in impulses_test.cpp; 24 contacts of a particle in each sweep.
      const double changes = scene.parameters.settings.max_iterations * 24 + 12;
      const double bound = 4 * round_off() * scene.parameters.settings.substeps * changes * scale;
      EXPECT_LE(left.norm(), bound) << "step " << step;
      EXPECT_LE(SumBy(impulses, kCloth).norm(), bound) << "step " << step;
      for (const ParticleImpulse& contact : *impulses.contacts) {
        if (contact.collider == kCloth) touched += contact.impulse_n_s.norm();
      }
      before = after;
    }
    EXPECT_GT(touched, 0.1 * MassOf(scene));
  }
}

TEST_P(ContactImpulses, OfAClothThatTouchesItselfBalance) {
  ExpectBalanceOfAFold(backend_name() == "gl" ? 8 : 20);
}

class ContactImpulsesLong : public ContactImpulses {};
INSTANTIATE_TEST_SUITE_P(Backends, ContactImpulsesLong, testing::Values("gl"),
                         [](const auto& one) { return one.param; });

TEST_P(ContactImpulsesLong, OfAClothThatTouchesItselfBalance) {
  ExpectBalanceOfAFold(20);
}

// Asked for or not, in any order, the states have the same bits; only who asks is told.
TEST_P(ContactImpulses, ChangeNoBit) {
  Scene scene = FallingOnSphere(12);
  for (Vector3d& v : scene.state.velocities_m_per_s) v.y() = -2.5;
  const ClothHandle asked = Make(scene), told = Make(scene), plain = Make(scene);
  for (uint32_t step = 0; step < 12; ++step) {
    std::vector<StepItem> items = {Asking(asked, scene), Asking(told, scene), Asking(plain, scene)};
    items[0].contact_impulses = step % 3 != 2;
    items[1].contact_impulses = false;
    items[2].contact_impulses = items[2].impulses = false;
    const BatchReport batch = backend().Step(items);
    ASSERT_TRUE(ReadBits(backend(), asked) == ReadBits(backend(), plain)) << "step " << step;
    ASSERT_TRUE(ReadBits(backend(), told) == ReadBits(backend(), plain)) << "step " << step;
    ASSERT_NE(batch.reports[0].impulses, nullptr);
    ASSERT_NE(batch.reports[1].impulses, nullptr);
    EXPECT_EQ(batch.reports[0].impulses->contacts.has_value(), step % 3 != 2);
    EXPECT_FALSE(batch.reports[1].impulses->contacts.has_value());
    for (uint32_t c = 0; c < scene.parameters.colliders.size(); ++c) {
      EXPECT_EQ(batch.reports[0].impulses->colliders[c].impulse_n_s,
                batch.reports[1].impulses->colliders[c].impulse_n_s);
    }
  }
}

// gl leaves worlds to cpu.
class ContactsOfWorlds : public PhysicsTest {};
INSTANTIATE_TEST_SUITE_P(Backends, ContactsOfWorlds, testing::Values("reference", "cpu"),
                         NameOfCase<testing::TestParamInfo<std::string>>);

// A layer falls onto one that lies: what either gets from cloth is the opposite of the other's, and
// at rest the upper one's weight.
TEST_P(ContactsOfWorlds, OfTwoLayersAddUpToNothing) {
  Scene lower = Grid(9, 9, 0.3, 0.3), upper = MeshedGrid(8, 8, 0.28, 0.28);
  for (Scene* const scene : {&lower, &upper}) {
    Touch(*scene, 0.3, 52);
    scene->parameters.damping_per_s = 4;
    scene->parameters.thickness_m = 0.004;
    scene->parameters.colliders = {PlaneThrough({0, 0, 0}, {0, 1, 0})};
  }
  for (Vector3d& p : lower.state.positions_m) p.y() += 0.0041;
  for (Vector3d& p : upper.state.positions_m) p += Vector3d(0.01, 0.011, 0.01);
  ClothWorld world(backend(), 1, {lower, upper});
  ParticleState before[2] = {world.State(0), world.State(1)};
  for (uint32_t step = 0; step < 120; ++step) {
    std::vector<StepItem> items = world.Items();
    for (StepItem& item : items) item.impulses = item.contact_impulses = true;
    const auto reports = backend().Step(items).reports;
    const StepImpulses* const impulses[2] = {&ImpulsesOf(reports[0]), &ImpulsesOf(reports[1])};
    Vector3d by_cloth = Vector3d::Zero();
    double scale = 0;
    for (size_t k = 0; k < 2; ++k) {
      const Scene& scene = world.scene(k);
      ExpectOrder(*impulses[k], scene);
      by_cloth += SumBy(*impulses[k], kCloth);
      const ParticleState after = world.State(k);
      scale += MassOf(scene) * (LargestSpeed(before[k]) + LargestSpeed(after) + kG / 60) +
               SizeOf(*impulses[k]);
      before[k] = after;
    }
    // Of every pair both sides are rounded, in each substep and sweep, to the velocities there.
    EXPECT_LE(by_cloth.norm(), 4 * round_off() * 52 * 24 * scale) << "step " << step;
    if (step < 119) continue;
    const double lower_n_s = MassOf(lower) * kG / 60, upper_n_s = MassOf(upper) * kG / 60;
    // What still moves after two seconds of damping; with one step damping carries c h/2 of it.
    EXPECT_NEAR(SumBy(*impulses[1], kCloth).y(), upper_n_s, 0.01 * upper_n_s);
    EXPECT_NEAR(SumBy(*impulses[0], 0).y(), lower_n_s + upper_n_s, 0.01 * (lower_n_s + upper_n_s));
    EXPECT_TRUE(SumBy(*impulses[1], 0).isZero(0)) << "the upper one does not touch the floor";
  }
}

}  // namespace
}  // namespace drape::test
