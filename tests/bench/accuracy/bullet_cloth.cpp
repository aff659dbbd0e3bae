#include "tests/bench/accuracy/bullet_cloth.h"

#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include "server/core/check.h"
#include "tests/support/plain_settings.h"

namespace drape::bench {
namespace {

constexpr btScalar kVoxel_m = 0.02F;

btVector3 ToBullet(const Eigen::Vector3d& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

Eigen::Vector3d FromBullet(const btVector3& v) {
  return {v.x(), v.y(), v.z()};
}

// A world of its own for one cloth. Members are destroyed from the last to the first.
class BulletWorld {
 public:
  BulletWorld(const test::Scene& scene, const BulletSettings& settings) {
    const btVector3 gravity = ToBullet(scene.parameters.gravity_m_per_s2);
    world_.setGravity(gravity);
    btSoftBodyWorldInfo& info = world_.getWorldInfo();
    info.m_gravity = gravity;
    info.m_broadphase = &broadphase_;
    info.m_dispatcher = &dispatcher_;
    info.air_density = 0;
    // Bullet samples the distance to rigid shapes; its own 0.25 m would let the cloth sink by 63
    // mm.
    info.m_sparsesdf.Initialize();
    info.m_sparsesdf.setDefaultVoxelsz(kVoxel_m);
    info.m_sparsesdf.Reset();
    for (const Collider& collider : scene.parameters.colliders) AddSphere(scene, collider);
    AddCloth(scene, settings);
  }
  ~BulletWorld() {
    world_.removeSoftBody(cloth_.get());
    for (const auto& sphere : spheres_) world_.removeCollisionObject(&sphere->object);
  }
  BulletWorld(const BulletWorld&) = delete;
  BulletWorld& operator=(const BulletWorld&) = delete;

  void Step(double substep_s) { world_.stepSimulation(static_cast<btScalar>(substep_s), 0); }
  const btSoftBody& cloth() const { return *cloth_; }

 private:
  struct Sphere {
    explicit Sphere(btScalar radius) : shape(radius) {}
    btSphereShape shape;
    btCollisionObject object;
  };

  // Bullet multiplies the friction of both; 1 here leaves that of the cloth.
  void AddSphere(const test::Scene& scene, const Collider& collider) {
    const auto* sphere = std::get_if<SphereShape>(&collider.shape);
    DRAPE_CHECK(sphere != nullptr, scene.name + ": only spheres for the peer");
    spheres_.push_back(std::make_unique<Sphere>(static_cast<btScalar>(sphere->radius_m)));
    btCollisionObject& object = spheres_.back()->object;
    object.setCollisionShape(&spheres_.back()->shape);
    btTransform transform = btTransform::getIdentity();
    transform.setOrigin(ToBullet(collider.pose.position_m));
    object.setWorldTransform(transform);
    object.setFriction(1);
    world_.addCollisionObject(&object);
  }

  void AddCloth(const test::Scene& scene, const BulletSettings& settings) {
    const SceneModel& model = *scene.model;
    DRAPE_CHECK(!model.has_compliance() && model.spring_count() == 0, "links only");
    std::vector<btVector3> positions;
    std::vector<btScalar> masses;
    for (uint32_t i = 0; i < model.particle_count(); ++i) {
      positions.push_back(ToBullet(scene.state.positions_m[i]));
      const double w = model.inverse_masses_per_kg()[i];
      masses.push_back(w == 0 ? 0 : static_cast<btScalar>(1 / w));
    }
    cloth_ =
        std::make_unique<btSoftBody>(&world_.getWorldInfo(), static_cast<int>(positions.size()),
                                     positions.data(), masses.data());
    for (uint32_t i = 0; i < model.particle_count(); ++i) {
      cloth_->m_nodes[static_cast<int>(i)].m_v = ToBullet(scene.state.velocities_m_per_s[i]);
    }
    for (const DistanceConstraint& c : model.constraints()) {
      cloth_->appendLink(static_cast<int>(c.i), static_cast<int>(c.j));
    }
    cloth_->m_materials[0]->m_kLST = 1;
    cloth_->m_cfg.piterations = static_cast<int>(settings.iterations);
    cloth_->m_cfg.kDF = static_cast<btScalar>(scene.parameters.friction_dynamic);
    cloth_->m_cfg.collisions = btSoftBody::fCollision::SDF_RS;
    cloth_->getCollisionShape()->setMargin(static_cast<btScalar>(scene.parameters.thickness_m));
    cloth_->setActivationState(DISABLE_DEACTIVATION);
    world_.addSoftBody(cloth_.get());
  }

  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btSoftRigidDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<Sphere>> spheres_;
  std::unique_ptr<btSoftBody> cloth_;
};

class BulletCloth final : public Contestant {
 public:
  BulletCloth(const test::Scene& scene, const BulletSettings& settings)
      : scene_(scene), settings_(settings) {}

  void Restart() override { world_ = std::make_unique<BulletWorld>(scene_, settings_); }

  FrameReport Step() override {
    for (uint32_t k = 0; k < settings_.substeps; ++k) world_->Step(kFrame_s / settings_.substeps);
    return {settings_.substeps * settings_.iterations, false};
  }

  ParticleState State() override {
    ParticleState state;
    const auto& nodes = world_->cloth().m_nodes;
    for (int i = 0; i < nodes.size(); ++i) {
      state.positions_m.push_back(FromBullet(nodes[i].m_x));
      state.velocities_m_per_s.push_back(FromBullet(nodes[i].m_v));
    }
    return state;
  }

 private:
  const test::Scene& scene_;
  BulletSettings settings_;
  std::unique_ptr<BulletWorld> world_;
};

}  // namespace

std::unique_ptr<Contestant> MakeBulletCloth(const test::Scene& scene,
                                            const BulletSettings& settings) {
  return std::make_unique<BulletCloth>(scene, settings);
}

std::vector<Entry> BulletEntries(const test::Scene& scene, bool is_quick) {
  std::vector<BulletSettings> all = {{1, 10}, {1, 50}, {1, 100}, {4, 4}, {4, 25},
                                     {16, 1}, {16, 6}, {60, 1},  {60, 4}};
  if (is_quick) all = {{1, 10}, {16, 1}};
  std::vector<Entry> entries;
  for (const BulletSettings& settings : all) {
    const std::string sizes =
        std::to_string(settings.substeps) + "x" + std::to_string(settings.iterations);
    StepSettings table = test::PlainSettings();  // only what the columns show
    table.substeps = settings.substeps;
    table.max_iterations = settings.iterations;
    entries.push_back({"bullet",
                       {"Bullet soft body", "Bullet " + sizes, table},
                       "steps=" + std::to_string(settings.substeps) +
                           " piterations=" + std::to_string(settings.iterations),
                       MakeBulletCloth(scene, settings)});
  }
  return entries;
}

}  // namespace drape::bench
