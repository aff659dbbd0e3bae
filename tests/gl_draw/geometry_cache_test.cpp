#include "server/render/gl_draw/geometry_cache.h"

#include <gtest/gtest.h>

#include "server/gl/context.h"
#include "tests/gl_draw/pictures.h"

namespace drape::render {
namespace {

class GeometryCacheTest : public testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<gl::Context>> context = gl::Context::Create({});
    ASSERT_TRUE(context.ok()) << context.status().ToString();
    context_ = std::move(context).value();
  }

  static const DeviceGeometry* Acquire(GeometryCache& cache,
                                       const std::shared_ptr<const SceneModel>& model) {
    const auto geometry = cache.Acquire(model);
    DRAPE_CHECK(geometry.ok(), geometry.status().ToString());
    return geometry.value().get();
  }

 private:
  std::unique_ptr<gl::Context> context_;
};

constexpr int64_t kMuch = int64_t{1} << 30;

TEST_F(GeometryCacheTest, UploadsAModelOnceWhileItLives) {
  GeometryCache cache(kMuch, kMuch);
  auto model = GridModel(4);
  const auto other = GridModel(5);
  const DeviceGeometry* first = Acquire(cache, model);
  EXPECT_EQ(first->index_count, 3 * model->triangles().size());
  EXPECT_NEAR(first->rest_diagonal_m, std::sqrt(2), 1e-12);
  Acquire(cache, other);
  EXPECT_EQ(Acquire(cache, model), first);
  const int64_t both_bytes = cache.size_bytes();
  const int64_t first_bytes = first->size_bytes();
  model.reset();
  cache.DropEndedModels();
  EXPECT_EQ(cache.size_bytes(), both_bytes - first_bytes);
  for (uint32_t k = 0; k < 100; ++k) {  // at addresses of models that have ended, too
    const auto short_lived = GridModel(2 + k % 3);
    EXPECT_EQ(Acquire(cache, short_lived)->index_count, 3 * short_lived->triangles().size());
  }
  cache.DropEndedModels();
  EXPECT_EQ(cache.size_bytes(), both_bytes - first_bytes);
}

TEST_F(GeometryCacheTest, DropsWhatWasNotUsedForLongest) {
  const auto a = GridModel(8);
  const auto b = GridModel(8);
  const auto c = GridModel(8);
  GeometryCache measure(kMuch, kMuch);
  const int64_t one_bytes = Acquire(measure, a)->size_bytes();
  GeometryCache cache(2 * one_bytes, kMuch);
  const DeviceGeometry* geometry_of_a = Acquire(cache, a);
  Acquire(cache, b);
  Acquire(cache, a);
  Acquire(cache, c);
  EXPECT_EQ(cache.size_bytes(), 2 * one_bytes);
  EXPECT_EQ(Acquire(cache, a), geometry_of_a);
}

TEST_F(GeometryCacheTest, AModelTooLargeForTheDeviceIsRefused) {
  GeometryCache cache(kMuch, 1000);
  const auto geometry = cache.Acquire(GridModel(8));
  ASSERT_FALSE(geometry.ok());
  EXPECT_EQ(geometry.status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(geometry.status().reason(), "DEVICE_MEMORY");
  EXPECT_EQ(cache.size_bytes(), 0);
}

}  // namespace
}  // namespace drape::render
