; The installer of Lightpen for one user. Built by installer/build.py, which defines
; VERSION, NUMBERS, PAYLOAD, OUTFILE, ICON, SIZE_KB and SLASH, for a quick build QUICK,
; for the quickest STORED as well.
;
; Options: /S silent, /D=FOLDER (last, without quotes), /DOWNGRADE over a newer version,
; /DESKTOP an icon on the desktop. Of the uninstaller: /S, /PURGE the user's data, too.
;
; Exit status: 0 done, 1 cancelled, 4 unsuitable Windows, 5 the program runs, 6 a newer
; version is installed, 7 the folder holds something else, 8 it cannot be written,
; 9 there is no space, 10 some files could not be written.

Unicode true
!ifdef TARGET
  Target ${TARGET}
!endif
!include MUI2.nsh
!include FileFunc.nsh
!include LogicLib.nsh
!include WinVer.nsh
!include x64.nsh
!include WordFunc.nsh
!include Integration.nsh

!define NAME      "Lightpen"
!define EXE       "Lightpen.exe"
!define PUBLISHER "Lightpen project"
!define UNKEY     "Software\Microsoft\Windows\CurrentVersion\Uninstall\${NAME}"
!define APPPATH   "Software\Microsoft\Windows\CurrentVersion\App Paths\${EXE}"
!define CLASSES   "Software\Classes"
!define SWING     "Lightpen.Swing"
!define RESULT    "Lightpen.Result"
!define MARKER    "install.ini"
!define DATA      "$LOCALAPPDATA\lightpen"
!define MENU      "$SMPROGRAMS\${NAME}"
!define RESERVE   200 ; MB that stay free for the first swings

Name "${NAME} ${VERSION}"
OutFile "${OUTFILE}"
RequestExecutionLevel user
InstallDir "$LOCALAPPDATA\Programs\${NAME}"
InstallDirRegKey HKCU "${UNKEY}" "InstallLocation"
!ifdef QUICK
  SetCompressor zlib
  !ifdef STORED
    SetCompress off
  !endif
!else
  SetCompressor /SOLID /FINAL lzma
  SetCompressorDictSize 64
!endif
CRCCheck force
ManifestDPIAware true
ManifestSupportedOS Win10
ManifestLongPathAware true
BrandingText "${NAME} ${VERSION}"
AllowSkipFiles off
SetOverwrite on
ShowInstDetails nevershow
ShowUninstDetails nevershow

VIProductVersion "${NUMBERS}"
VIFileVersion    "${NUMBERS}"
VIAddVersionKey "ProductName"      "${NAME}"
VIAddVersionKey "ProductVersion"   "${VERSION}"
VIAddVersionKey "FileVersion"      "${VERSION}"
VIAddVersionKey "FileDescription"  "${NAME} setup"
VIAddVersionKey "CompanyName"      "${PUBLISHER}"
VIAddVersionKey "LegalCopyright"   "MIT licence"
VIAddVersionKey "OriginalFilename" "${NAME}-${VERSION}-setup.exe"

!define MUI_ICON   "${ICON}"
!define MUI_UNICON "${ICON}"
!define MUI_ABORTWARNING
!define MUI_FINISHPAGE_RUN "$INSTDIR\${EXE}"
!define MUI_FINISHPAGE_NOREBOOTSUPPORT
!insertmacro MUI_PAGE_WELCOME
!insertmacro MUI_PAGE_LICENSE "${PAYLOAD}\LICENCES.txt"
!insertmacro MUI_PAGE_COMPONENTS
!insertmacro MUI_PAGE_DIRECTORY
!insertmacro MUI_PAGE_INSTFILES
!insertmacro MUI_PAGE_FINISH
!insertmacro MUI_UNPAGE_CONFIRM
!insertmacro MUI_UNPAGE_INSTFILES
!insertmacro MUI_LANGUAGE "English"
!insertmacro MUI_LANGUAGE "SimpChinese"
!include words.nsh

!ifdef SIGN
  !finalize      '${SIGN} "%1"' = 0
  !uninstfinalize '${SIGN} "%1"' = 0
!endif

!macro Refuse status text
  MessageBox MB_OK|MB_ICONSTOP "${text}" /SD IDOK
  SetErrorLevel ${status}
  Quit
!macroend
!define Refuse "!insertmacro Refuse"

; ---- what installer and uninstaller share

!macro Shared un
; Sets $R9 to 1 if a program that runs keeps a file from being written.
Function ${un}IsHeld
  Pop $R7
  StrCpy $R9 0
  ${If} ${FileExists} "$R7"
    ClearErrors
    FileOpen $R8 "$R7" a
    ${If} ${Errors}
      StrCpy $R9 1
    ${Else}
      FileClose $R8
    ${EndIf}
  ${EndIf}
FunctionEnd

Function ${un}AwaitEnd
  ${Do}
    Push "$INSTDIR\${EXE}"
    Call ${un}IsHeld
    ${If} $R9 = 0
      Push "$INSTDIR\bin\lightpen.exe"
      Call ${un}IsHeld
    ${EndIf}
    ${If} $R9 = 0
      ${ExitDo}
    ${EndIf}
    MessageBox MB_RETRYCANCEL|MB_ICONEXCLAMATION "$(IS_RUNNING)" /SD IDCANCEL IDRETRY +3
      SetErrorLevel 5
      Quit
  ${Loop}
FunctionEnd

; All that is ever installed, and nothing else: what the user has put there stays.
Function ${un}RemoveFiles
  RMDir /r "$INSTDIR\runtime"
  RMDir /r "$INSTDIR\bin"
  RMDir /r "$INSTDIR\licences"
  Delete "$INSTDIR\start.py"
  Delete "$INSTDIR\files.sha256"
  Delete "$INSTDIR\LICENCES.txt"
  Delete "$INSTDIR\sbom.cdx.json"
  Delete "$INSTDIR\${EXE}"
FunctionEnd
!macroend
!insertmacro Shared ""
!insertmacro Shared "un."

; ---- installing

Function .onInit
  SetShellVarContext current
  ${IfNot} ${AtLeastWin10}
    ${Refuse} 4 "$(OLD_WINDOWS)"
  ${EndIf}
  ${IfNot} ${RunningX64}
    ${Refuse} 4 "$(NOT_64_BIT)"
  ${EndIf}
  SetRegView 64
  ReadRegStr $0 HKCU "${UNKEY}" "DisplayVersion"
  ${If} $0 != ""
    ${VersionCompare} "$0" "${VERSION}" $1
    ${If} $1 = 1
      ${GetParameters} $2
      ClearErrors
      ${GetOptions} $2 "/DOWNGRADE" $3
      ${If} ${Errors}
        MessageBox MB_YESNO|MB_ICONQUESTION "$(IS_NEWER)" /SD IDNO IDYES +3
          SetErrorLevel 6
          Quit
      ${EndIf}
    ${EndIf}
  ${EndIf}
FunctionEnd

Section "$(PROGRAM)" SecProgram
  SectionIn RO
  Call AwaitEnd

  ; Only an empty folder, or one that this installer has made.
  ${If} ${FileExists} "$INSTDIR\*.*"
  ${AndIfNot} ${FileExists} "$INSTDIR\${MARKER}"
    ${DirState} "$INSTDIR" $0
    ${If} $0 = 1
      ${Refuse} 7 "$(IS_FOREIGN)"
    ${EndIf}
  ${EndIf}

  ClearErrors
  CreateDirectory "$INSTDIR"
  WriteINIStr "$INSTDIR\${MARKER}" "install" "name" "${NAME}"
  ${If} ${Errors}
    ${Refuse} 8 "$(NO_RIGHT)"
  ${EndIf}
  FlushINI "$INSTDIR\${MARKER}" ; which sets the error flag though it succeeds

  ; By the folder, not its drive: another disk may be mounted there.
  System::Call 'kernel32::GetDiskFreeSpaceExW(w "$INSTDIR", *l .r1, *l, *l)i.r0'
  ${If} $0 <> 0
    System::Int64Op $1 / 1048576
    Pop $1
    IntOp $2 ${SIZE_KB} / 1024
    IntOp $2 $2 + ${RESERVE}
    System::Int64Op $1 < $2
    Pop $3
    ${If} $3 = 1
      ; An older version that is there stays as it is.
      ${IfNot} ${FileExists} "$INSTDIR\${EXE}"
        Delete "$INSTDIR\${MARKER}"
        RMDir "$INSTDIR"
      ${EndIf}
      ${Refuse} 9 "$(NO_SPACE)"
    ${EndIf}
  ${EndIf}

  ; No module of an older version may stay. Until all is written no version is stated.
  DeleteINIStr "$INSTDIR\${MARKER}" "install" "version"
  Call RemoveFiles
  SetOutPath "$INSTDIR"
  ClearErrors
  File /r "${PAYLOAD}${SLASH}*"
  ${If} ${Errors}
    ${Refuse} 10 "$(NOT_WRITTEN)"
  ${EndIf}
  WriteUninstaller "$INSTDIR\uninstall.exe"
  WriteINIStr "$INSTDIR\${MARKER}" "install" "version" "${VERSION}"
  FlushINI "$INSTDIR\${MARKER}"

  SetOutPath "$PROFILE" ; in which programs begin that are started from the menu
  CreateDirectory "${MENU}"
  CreateShortCut "${MENU}\${NAME}.lnk" "$INSTDIR\${EXE}" "" "$INSTDIR\${EXE}" 0
  CreateShortCut "${MENU}\$(CONSOLE).lnk" "$SYSDIR\cmd.exe" \
    '/k set "PATH=$INSTDIR\bin;%PATH%" && lightpen --help' "$INSTDIR\${EXE}" 0

  WriteRegStr HKCU "${APPPATH}" "" "$INSTDIR\${EXE}"
  WriteRegStr HKCU "${UNKEY}" "DisplayName" "${NAME}"
  WriteRegStr HKCU "${UNKEY}" "DisplayVersion" "${VERSION}"
  WriteRegStr HKCU "${UNKEY}" "Publisher" "${PUBLISHER}"
  WriteRegStr HKCU "${UNKEY}" "DisplayIcon" "$INSTDIR\${EXE},0"
  WriteRegStr HKCU "${UNKEY}" "InstallLocation" "$INSTDIR"
  WriteRegStr HKCU "${UNKEY}" "UninstallString" '"$INSTDIR\uninstall.exe"'
  WriteRegStr HKCU "${UNKEY}" "QuietUninstallString" '"$INSTDIR\uninstall.exe" /S'
  WriteRegDWORD HKCU "${UNKEY}" "EstimatedSize" ${SIZE_KB}
  WriteRegDWORD HKCU "${UNKEY}" "NoModify" 1
  WriteRegDWORD HKCU "${UNKEY}" "NoRepair" 1

  ; The file in the folder of each swing opens with a double click. Results are JSON,
  ; whose double click belongs to the user's editor: there Lightpen is in "Open with".
  WriteRegStr HKCU "${CLASSES}\${SWING}" "" "$(SWING_FILE)"
  WriteRegStr HKCU "${CLASSES}\${SWING}\DefaultIcon" "" "$INSTDIR\${EXE},0"
  WriteRegStr HKCU "${CLASSES}\${SWING}\shell\open\command" "" '"$INSTDIR\${EXE}" open "%1"'
  WriteRegStr HKCU "${CLASSES}\.lightpen\OpenWithProgids" "${SWING}" ""
  ReadRegStr $0 HKCU "${CLASSES}\.lightpen" ""
  ${If} $0 == ""
    WriteRegStr HKCU "${CLASSES}\.lightpen" "" "${SWING}"
  ${EndIf}
  WriteRegStr HKCU "${CLASSES}\${RESULT}" "" "$(RESULT_FILE)"
  WriteRegStr HKCU "${CLASSES}\${RESULT}\DefaultIcon" "" "$INSTDIR\${EXE},0"
  WriteRegStr HKCU "${CLASSES}\${RESULT}\shell\open\command" "" '"$INSTDIR\${EXE}" open "%1"'
  WriteRegStr HKCU "${CLASSES}\.json\OpenWithProgids" "${RESULT}" ""
  ${NotifyShell_AssocChanged}

  ${GetParameters} $0
  ClearErrors
  ${GetOptions} $0 "/DESKTOP" $1
  ${IfNot} ${Errors}
    CreateShortCut "$DESKTOP\${NAME}.lnk" "$INSTDIR\${EXE}" "" "$INSTDIR\${EXE}" 0
  ${EndIf}
SectionEnd

Section /o "$(DESKTOP_ICON)" SecDesktop
  CreateShortCut "$DESKTOP\${NAME}.lnk" "$INSTDIR\${EXE}" "" "$INSTDIR\${EXE}" 0
SectionEnd

!insertmacro MUI_FUNCTION_DESCRIPTION_BEGIN
  !insertmacro MUI_DESCRIPTION_TEXT ${SecProgram} "$(PROGRAM_ABOUT)"
  !insertmacro MUI_DESCRIPTION_TEXT ${SecDesktop} "$(DESKTOP_ABOUT)"
!insertmacro MUI_FUNCTION_DESCRIPTION_END

; ---- uninstalling

Function un.onInit
  SetShellVarContext current
  SetRegView 64
  ${IfNot} ${FileExists} "$INSTDIR\${MARKER}"
    ${Refuse} 7 "$(NOT_INSTALLED)"
  ${EndIf}
FunctionEnd

Section "Uninstall"
  Call un.AwaitEnd
  Call un.RemoveFiles
  Delete "$INSTDIR\${MARKER}"
  Delete "$INSTDIR\uninstall.exe"
  RMDir "$INSTDIR" ; if nothing else is in it

  Delete "${MENU}\*.lnk" ; named in the language of the installation
  RMDir "${MENU}"
  Delete "$DESKTOP\${NAME}.lnk"
  ReadRegStr $0 HKCU "${CLASSES}\.lightpen" ""
  ${If} $0 == "${SWING}"
    DeleteRegValue HKCU "${CLASSES}\.lightpen" ""
  ${EndIf}
  DeleteRegValue HKCU "${CLASSES}\.lightpen\OpenWithProgids" "${SWING}"
  DeleteRegKey /ifempty HKCU "${CLASSES}\.lightpen\OpenWithProgids"
  ; "If empty" knows of keys only: what another program has set must stay.
  ReadRegStr $0 HKCU "${CLASSES}\.lightpen" ""
  ${If} $0 == ""
    DeleteRegKey /ifempty HKCU "${CLASSES}\.lightpen"
  ${EndIf}
  DeleteRegValue HKCU "${CLASSES}\.json\OpenWithProgids" "${RESULT}"
  EnumRegValue $0 HKCU "${CLASSES}\.json\OpenWithProgids" 0
  ${If} $0 == ""
    DeleteRegKey /ifempty HKCU "${CLASSES}\.json\OpenWithProgids"
    ReadRegStr $0 HKCU "${CLASSES}\.json" ""
    EnumRegValue $1 HKCU "${CLASSES}\.json" 0
    ${If} $0 == ""
    ${AndIf} $1 == ""
      DeleteRegKey /ifempty HKCU "${CLASSES}\.json"
    ${EndIf}
  ${EndIf}
  DeleteRegKey HKCU "${CLASSES}\${SWING}"
  DeleteRegKey HKCU "${CLASSES}\${RESULT}"
  DeleteRegKey HKCU "${APPPATH}"
  DeleteRegKey HKCU "${UNKEY}"
  ${NotifyShell_AssocChanged}

  ${un.GetParameters} $0
  ClearErrors
  ${un.GetOptions} $0 "/PURGE" $1
  ${IfNot} ${Errors}
    RMDir /r "${DATA}"
  ${EndIf}
SectionEnd
