// Pictures of the states that a backend has on its device.
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "server/gl/device_copy.h"
#include "server/solver/device_backend.h"
#include "server/solver/gl_compute/gl_backend.h"
#include "tests/gl_draw/pictures.h"

namespace drape::render {
namespace {

class DeviceStatesTest : public testing::Test {
 protected:
  void SetUp() override {
    GlBackendOptions options;
    options.on_context = [this](const gl::ShareHandle& handle) { handle_ = handle; };
    Result<std::unique_ptr<Backend>> backend = CreateGlBackend(options);
    ASSERT_TRUE(backend.ok()) << backend.status().ToString();
    backend_ = std::move(backend).value();
    ASSERT_NE(handle_.context, nullptr);
    for (const uint32_t side : {12u, 7u, 12u}) {
      const auto model = GridModel(side, 1, {0, side - 1});
      ParticleState state;
      state.positions_m.assign(model->rest_positions_m().begin(), model->rest_positions_m().end());
      state.velocities_m_per_s.assign(state.positions_m.size(), Eigen::Vector3d::Zero());
      const Result<ClothHandle> cloth = backend_->Create(model, {}, state);
      ASSERT_TRUE(cloth.ok()) << cloth.status().ToString();
      handles_.push_back(cloth.value());
      drawn_.push_back(
          {.model = model,
           .placement = {.environment_origin_m = {1.3 * static_cast<double>(handles_.size()), 0,
                                                  0}},
           .colliders = {}});
    }
  }

  void Step(int steps) {
    std::vector<StepItem> items;
    for (const ClothHandle handle : handles_) items.push_back({handle, {}, false});
    for (int k = 0; k < steps; ++k) backend_->Step(items);
  }

  gl::ShareHandle handle_;
  std::unique_ptr<Backend> backend_;
  std::vector<ClothHandle> handles_;
  std::vector<DrawnCloth> drawn_;
};

TEST_F(DeviceStatesTest, SamePictureFromTheDeviceAndFromTheHost) {
  Step(12);
  for (const Colouring colouring : {Colouring::kMaterial, Colouring::kStrain, Colouring::kSpeed}) {
    const ReadRequest request{handles_, true, colouring == Colouring::kSpeed};
    const DrawnStates host{.host = backend_->Read(request), .device = nullptr};
    DrawnStates device{.host = {}, .device = backend_->device()->CopyOnDevice(request)};
    ASSERT_NE(device.device, nullptr);
    // The cloths are stepped on while the picture is drawn: it shows the copied states.
    Step(3);
    PictureSpec spec = SmallSpec(400, 300);
    spec.colouring = colouring;
    std::thread([&] {
      const auto renderer = MakeRenderer({.share_with = handle_});
      ASSERT_TRUE(renderer->takes_device_copies());
      const Result<Picture> from_device = renderer->Draw(spec, drawn_, device);
      const Result<Picture> from_host = renderer->Draw(spec, drawn_, host);
      device.device.reset();
      ASSERT_TRUE(from_device.ok() && from_host.ok());
      EXPECT_EQ(Difference(*from_device, *from_host, 0).count, 0u);
      EXPECT_EQ(from_device->range.low, from_host->range.low);
      EXPECT_EQ(from_device->range.high, from_host->range.high);
      EXPECT_TRUE(from_device->bounds_m.isApprox(from_host->bounds_m));
    }).join();
  }
}

TEST_F(DeviceStatesTest, DrawsWhileTheBackendSteps) {
  std::vector<std::shared_ptr<DeviceCopy>> copies;
  for (int k = 0; k < 6; ++k) {
    Step(1);
    copies.push_back(backend_->device()->CopyOnDevice({handles_, true, false}));
    ASSERT_NE(copies.back(), nullptr);
  }
  std::thread drawing([&] {
    const auto renderer = MakeRenderer({.share_with = handle_});
    for (auto& copy : copies) {
      const Result<Picture> picture = renderer->Draw(SmallSpec(), drawn_, {{}, copy});
      EXPECT_TRUE(picture.ok()) << picture.status().ToString();
      copy.reset();
    }
  });
  Step(30);
  drawing.join();
  const std::vector<float> after =
      std::get<std::vector<float>>(backend_->Read({handles_, true, false}).positions_m);
  EXPECT_LT(after.back(), 10);
}

TEST_F(DeviceStatesTest, WithoutASharedContextTheHostsStatesAreDrawn) {
  const auto renderer = MakeRenderer();
  EXPECT_FALSE(renderer->takes_device_copies());
  // An invalid context cannot be shared: a warning, and a renderer with its own context.
  const auto fallback = MakeRenderer({.share_with = gl::ShareHandle{handle_.display, &handle_}});
  EXPECT_FALSE(fallback->takes_device_copies());
  const Result<Picture> picture =
      fallback->Draw(SmallSpec(), drawn_, {backend_->Read({handles_, true, false}), nullptr});
  EXPECT_TRUE(picture.ok());
}

TEST(GlRendererErrorsTest, ShaderDirectoryAndDevice) {
  const auto missing = CreateGlRenderer({.shader_dir = "/no/such/folder"});
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.status().reason(), "SHADER_DIR_NOT_FOUND");
}

}  // namespace
}  // namespace drape::render
