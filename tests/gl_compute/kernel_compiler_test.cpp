// Kernels are compiled beside the device thread, and change nothing but who waits.
#include "server/solver/gl_compute/kernel_compiler.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <vector>

#include "server/solver/energy_watch.h"
#include "server/solver/gl_compute/gl_device.h"
#include "tests/gl_compute/test_cloths.h"

namespace drape {
namespace {

ClothParameters TwoStepParameters() {
  ClothParameters parameters = test::PlainParameters();
  parameters.settings.integration = Integration::kTwoStep;
  return parameters;
}

TEST(KernelCompilerTest, OthersStepWhileVariantsAreCompiled) {
  const std::unique_ptr<Backend> backend = MakeGlBackend();
  const auto model = GridModel(5, 5, {0});
  const ClothHandle cloth = CreateCloth(*backend, model);
  StepCloth(*backend, cloth);
  std::vector<ClothParameters> kinds(2, TwoStepParameters());
  kinds[1].damping_per_s = 0.1;
  std::atomic<bool> has_begun = false;
  std::atomic<bool> has_ended = false;
  std::thread builder([&, prepare = backend->Describe().prepare] {
    has_begun = true;
    for (const ClothParameters& kind : kinds) prepare(*model, kind);
    has_ended = true;
  });
  while (!has_begun) std::this_thread::yield();
  uint32_t steps = 0;
  for (; !has_ended; ++steps) EXPECT_EQ(StepCloth(*backend, cloth).fault, FaultReason::kNone);
  builder.join();
  EXPECT_GT(steps, 1u) << "the last one may have ended later";
  const std::unique_ptr<Backend> unprepared = MakeGlBackend();
  for (const ClothParameters& kind : kinds) {
    std::vector<std::vector<float>> states;
    for (Backend* each : {backend.get(), unprepared.get()}) {
      const ClothHandle its = CreateCloth(*each, model, kind);
      StepCloth(*each, its);
      states.push_back(ReadCloth(*each, its));
    }
    EXPECT_EQ(states[0], states[1]);
  }
}

TEST(KernelCompilerTest, KernelsOfTheCalmerSchemeFollow) {
  Result<GlDevice> device = GlDevice::Open({}, {});
  ASSERT_TRUE(device.ok()) << device.status().ToString();
  const auto variant_of = [&](const SceneModel& model, const ClothParameters& parameters) {
    return ChooseVariant(PlanOnDevice(model, parameters), device->traits).value().variant;
  };
  const auto model = GridModel(5, 5);
  const ClothParameters parameters = TwoStepParameters();
  const KernelVariant usual = variant_of(*model, parameters);
  const KernelVariant calmer = variant_of(*model, WithCalmerScheme(parameters));
  ASSERT_NE(usual, calmer);
  KernelCompiler compiler(device->kernels.get(), device->context->share_handle(), device->traits);
  EXPECT_FALSE(device->kernels->Known(usual).has_value());
  compiler.Prepare(*model, parameters);
  const auto known = device->kernels->Known(usual);
  ASSERT_TRUE(known.has_value());
  EXPECT_TRUE(known->ok());
  const auto limit = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  while (!device->kernels->Known(calmer) && std::chrono::steady_clock::now() < limit) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(device->kernels->Known(calmer).has_value());
  compiler.Stop();
  device->context->MakeCurrent();
}

TEST(KernelCompilerTest, KernelsThatTellAreCompiledBesideTheDeviceThread) {
  const std::unique_ptr<Backend> backend = MakeGlBackend();
  const ClothHandle cloth = CreateCloth(*backend, GridModel(5, 5, {0}));
  StepCloth(*backend, cloth);
  DeviceBackend& device = *backend->device();
  const auto steps_until = [&](const std::function<bool()>& is_ready) {
    uint32_t steps = 0;
    const auto limit = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    while (!is_ready() && std::chrono::steady_clock::now() < limit) {
      EXPECT_EQ(StepCloth(*backend, cloth).fault, FaultReason::kNone);
      ++steps;
    }
    EXPECT_TRUE(is_ready());
    return steps;
  };
  EXPECT_GT(steps_until([&] { return device.IsReadyToMeasure(); }), 0u) << "nobody has asked yet";
  EXPECT_GT(steps_until([&] { return device.IsReadyToTellImpulses(cloth); }), 0u);
  StepItem item;
  item.cloth = cloth;
  item.measure = item.impulses = true;
  const BatchReport report = backend->Step({&item, 1});
  EXPECT_GT(report.reports[0].measured.kinetic_energy_j, 0);
  EXPECT_NE(report.reports[0].impulses, nullptr);
  EXPECT_TRUE(device.IsReadyToTellImpulses(cloth));
}

TEST(KernelCompilerTest, NothingIsCompiledOnceItHasStopped) {
  Result<GlDevice> device = GlDevice::Open({}, {});
  ASSERT_TRUE(device.ok()) << device.status().ToString();
  const auto model = GridModel(5, 5);
  KernelCompiler compiler(device->kernels.get(), device->context->share_handle(), device->traits);
  compiler.Stop();
  compiler.Prepare(*model, TwoStepParameters());
  const auto choice = ChooseVariant(PlanOnDevice(*model, TwoStepParameters()), device->traits);
  EXPECT_FALSE(device->kernels->Known(choice.value().variant).has_value());
}

}  // namespace
}  // namespace drape
