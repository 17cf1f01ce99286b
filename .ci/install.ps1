# Installs the programs deltille and deltag from an archive of a release:
#
#     ./install.ps1 FROM [VERSION]
#
# FROM is the address or the folder where the archives of a release lie. The checksum is compared before anything is
# unpacked. The programs go to $env:DELTILLE_BIN, or to %LOCALAPPDATA%\Programs\deltille.
param(
  [Parameter(Mandatory = $true)][string]$From,
  [string]$Version = "0.1.0"
)
$ErrorActionPreference = "Stop"

$name = "deltille-$Version-x86_64-pc-windows-msvc"
$bin = if ($env:DELTILLE_BIN) { $env:DELTILLE_BIN } else { Join-Path $env:LOCALAPPDATA "Programs\deltille" }
$work = Join-Path ([IO.Path]::GetTempPath()) ([Guid]::NewGuid())
New-Item -ItemType Directory $work | Out-Null
try {
  foreach ($file in "$name.zip", "$name.zip.sha256") {
    if (Test-Path $From -PathType Container) {
      Copy-Item (Join-Path $From $file) $work
    } else {
      Invoke-WebRequest "$From/$file" -OutFile (Join-Path $work $file) -UseBasicParsing
    }
  }
  $archive = Join-Path $work "$name.zip"
  $stated = ((Get-Content "$archive.sha256") -split "\s+")[0]
  if ((Get-FileHash $archive -Algorithm SHA256).Hash -ne $stated) {
    throw "$name.zip is damaged: its checksum is another"
  }
  Expand-Archive $archive $work
  New-Item -ItemType Directory -Force $bin | Out-Null
  Copy-Item (Join-Path $work "$name\*.exe") $bin -Force
  Write-Output "deltille $Version is in $bin"
  if (($env:PATH -split ";") -notcontains $bin) {
    Write-Output "$bin is not in PATH: add it in the settings of the system"
  }
} finally {
  Remove-Item -Recurse -Force $work
}
