# Sees to a Python, then hands over to run.py; the file run is the same for Linux.
# For Windows PowerShell 5.1 and later. ASCII only: 5.1 reads other text wrongly.

$pythons = 'py -3.13', 'py -3.12', 'py -3.11', 'py -3.14', 'python', 'python3'
$isUsable = 'import ensurepip, ssl, sys, venv; sys.exit(sys.version_info < (3, 11) or sys.maxsize < 2**32)'

foreach ($python in $pythons) {
    $words = $python -split ' '
    $name = $words[0]
    $options = @($words | Select-Object -Skip 1)
    if (-not (Get-Command $name -CommandType Application -ErrorAction SilentlyContinue)) {
        continue
    }
    & $name @options -I -c $isUsable 2>&1 | Out-Null
    if ($LASTEXITCODE -eq 0) {
        & $name @options -I (Join-Path $PSScriptRoot 'run.py') @args
        exit $LASTEXITCODE
    }
}

Write-Output 'No 64-bit Python 3.11 or newer was found; a 32-bit one lacks the libraries.'
Write-Output 'Install one, for example with'
Write-Output '    winget install --exact --id Python.Python.3.13'
Write-Output 'then open a new window and run this command again.'
exit 1
