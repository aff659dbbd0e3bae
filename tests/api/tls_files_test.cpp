#include "server/api/tls_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

namespace drape::api {
namespace {

class TlsFiles : public testing::Test {
 protected:
  TlsFiles() {
    std::ofstream(good_) << "PEM";
    std::ofstream(empty_).flush();
  }
  ~TlsFiles() override {
    std::remove(good_.c_str());
    std::remove(empty_.c_str());
  }

  const std::string base_ = testing::TempDir() + "drape_tls_files_test_" +
                            testing::UnitTest::GetInstance()->current_test_info()->name();
  const std::string good_ = base_ + ".pem";
  const std::string empty_ = base_ + "_empty.pem";
  const std::string missing_ = base_ + "_missing.pem";
  ServerOptions options_;
};

TEST_F(TlsFiles, AreReadWhereTheyAreGiven) {
  EXPECT_TRUE(ReadTlsFiles("", "", options_).ok());
  EXPECT_EQ(options_.tls_certificate_pem, "");
  EXPECT_TRUE(ReadTlsFiles(good_, good_, options_).ok());
  EXPECT_EQ(options_.tls_certificate_pem, "PEM");
  EXPECT_EQ(options_.tls_key_pem, "PEM");
}

TEST_F(TlsFiles, UnreadableAndEmptyOnesAreErrors) {
  for (const std::string& bad : {empty_, missing_, testing::TempDir(), std::string()}) {
    for (const bool is_key : {false, true}) {
      const Status status = ReadTlsFiles(is_key ? good_ : bad, is_key ? bad : good_, options_);
      EXPECT_EQ(status.reason(), "TLS_FILE_FAILED") << bad;
      EXPECT_THAT(status.message(), testing::HasSubstr("'" + bad + "'"));
    }
  }
}

}  // namespace
}  // namespace drape::api
