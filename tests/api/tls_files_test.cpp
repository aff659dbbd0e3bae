#include "server/api/tls_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>

#include "tests/support/certificates/certificates.h"

namespace drape::api {
namespace {

class TlsFilesTest : public testing::Test {
 protected:
  std::string File(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.Path(name)) << text;
    return folder_.Path(name);
  }

  const test::CertificateFolder folder_;
  const test::Certificate own_ = folder_.MakeAuthority("own");
  const test::Certificate other_ = folder_.MakeAuthority("other");
};

TEST_F(TlsFilesTest, PairsAndAuthoritiesAreGood) {
  EXPECT_TRUE(CheckTlsFiles({}).ok());
  EXPECT_TRUE(CheckTlsFiles({.certificate = own_.certificate, .key = own_.key}).ok());
  EXPECT_TRUE(CheckTlsFiles({.certificate = own_.certificate,
                             .key = own_.key,
                             .client_authorities = other_.certificate})
                  .ok());
}

TEST_F(TlsFilesTest, WhatIsNoCertificateOrKeyIsNamed) {
  const std::string empty = File("empty.pem", ""), text = File("text.pem", "PEM");
  for (const std::string& bad :
       {empty, text, folder_.Path("missing.pem"), testing::TempDir(), std::string()}) {
    for (int which = 0; which < 3; ++which) {
      TlsFiles files{own_.certificate, own_.key, own_.certificate};
      if (which == 2 && bad.empty()) continue;  // no authorities are fine
      (which == 0 ? files.certificate : which == 1 ? files.key : files.client_authorities) = bad;
      const Status status = CheckTlsFiles(files);
      EXPECT_EQ(status.reason(), "TLS_FILE_FAILED") << which << " " << bad;
      EXPECT_THAT(status.message(), testing::HasSubstr("'" + bad + "'"));
    }
  }
}

TEST_F(TlsFilesTest, AKeyOfAnotherCertificateIsRefused) {
  const Status status = CheckTlsFiles({.certificate = own_.certificate, .key = other_.key});
  EXPECT_EQ(status.reason(), "TLS_FILE_FAILED");
  EXPECT_THAT(status.message(), testing::HasSubstr("is not the key of"));
}

// As where a certificate is renewed before its key.
TEST_F(TlsFilesTest, AWatchTellsOnceWhatBecomesBadAndGoodAgain) {
  const auto copy = [](const std::string& from, const std::string& to) {
    std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing);
  };
  const TlsFiles files{folder_.Path("used.pem"), folder_.Path("used.key")};
  copy(own_.certificate, files.certificate);
  copy(own_.key, files.key);
  TlsWatch watch(files);
  EXPECT_FALSE(watch.Look().has_value());
  copy(other_.certificate, files.certificate);
  const std::optional<Status> bad = watch.Look();
  ASSERT_TRUE(bad.has_value());
  EXPECT_THAT(bad->message(), testing::HasSubstr("is not the key of"));
  EXPECT_FALSE(watch.Look().has_value());
  copy(other_.key, files.key);
  const std::optional<Status> good = watch.Look();
  ASSERT_TRUE(good.has_value());
  EXPECT_TRUE(good->ok());
}

}  // namespace
}  // namespace drape::api
