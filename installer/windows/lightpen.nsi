; The installer of Lightpen for one user or for all. Built by installer/build.py, which
; defines VERSION, ORDER, NUMBERS, PAYLOAD, OUTFILE, ICON, SIZE_KB and SLASH, for a quick
; build STORED as well.
;
; Options: /S silent, /ALLUSERS for all users (the account SYSTEM always does so),
; /D=FOLDER (last, without quotes), /DOWNGRADE over a newer version, /DESKTOP an icon on
; the desktop. Of the uninstaller: /S, /PURGE the user's data, too.
;
; Exit status: 0 done, 1 cancelled, 4 unsuitable Windows, 5 the program runs, 6 a newer
; version is installed, 7 the folder holds something else, 8 it cannot be written,
; 9 there is no space, 10 some files could not be written, 11 /ALLUSERS without the
; rights of an administrator.

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
!define OLDEST    17763 ; build of Windows 10 1809

Name "${NAME} ${VERSION}"
OutFile "${OUTFILE}"
RequestExecutionLevel user
!ifdef STORED
  SetCompress off
!else
  SetCompressor /SOLID /FINAL lzma
  SetCompressorDictSize 256 ; both libraries of OpenBLAS hold much of the same
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

!define MOST_LOOKS 20 ; at a program that is held, a quarter of a second apart

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

; Waits until no program of the folder on the stack runs. One that has just ended, and
; that a scanner looks at, is held for a moment longer: only then a question is asked.
Function ${un}AwaitEnd
  Pop $R6
  StrCpy $R5 0
  ${Do}
    Push "$R6\${EXE}"
    Call ${un}IsHeld
    ${If} $R9 = 0
      Push "$R6\bin\lightpen.exe"
      Call ${un}IsHeld
    ${EndIf}
    ${If} $R9 = 0
      ${ExitDo}
    ${EndIf}
    IntOp $R5 $R5 + 1
    ${If} $R5 < ${MOST_LOOKS}
      Sleep 250
      ${Continue}
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

Var Before ; folder of an installation that is there already; empty if there is none

; For all users if /ALLUSERS says so, and always for the account SYSTEM, whose own
; programs nobody sees: Intune and SCCM install by it.
Function ChooseUsers
  SetShellVarContext current
  ${GetParameters} $2
  ClearErrors
  ${GetOptions} $2 "/ALLUSERS" $3
  ${If} ${Errors}
    StrCpy $3 "no"
  ${Else}
    StrCpy $3 "yes"
  ${EndIf}
  ReadEnvStr $4 "USERPROFILE"
  ${GetFileName} "$4" $4
  ${If} $3 == "yes"
  ${OrIf} $4 == "systemprofile"
    UserInfo::GetAccountType
    Pop $5
    ${If} $5 != "Admin"
      ${Refuse} 11 "$(NO_ADMINISTRATOR)"
    ${EndIf}
    SetShellVarContext all
    StrCpy $6 "$PROGRAMFILES64\${NAME}"
  ${Else}
    StrCpy $6 "$LOCALAPPDATA\Programs\${NAME}"
  ${EndIf}
  ReadRegStr $Before SHCTX "${UNKEY}" "InstallLocation"
  ${If} $INSTDIR == "" ; no /D
    StrCpy $INSTDIR $6
    ${If} $Before != ""
      StrCpy $INSTDIR $Before
    ${EndIf}
  ${EndIf}
FunctionEnd

; One installation at a time: that in another folder goes when this one is whole.
Function RemoveBefore
  ${If} $Before != ""
  ${AndIf} $Before != $INSTDIR
  ${AndIf} ${FileExists} "$Before\${MARKER}"
    ExecWait '"$Before\uninstall.exe" /S _?=$Before'
    Delete "$Before\uninstall.exe"
    RMDir "$Before"
  ${EndIf}
FunctionEnd

Function .onInit
  ${IfNot} ${AtLeastWin10}
  ${OrIfNot} ${AtLeastBuild} ${OLDEST}
    ${Refuse} 4 "$(OLD_WINDOWS)"
  ${EndIf}
  ${IfNot} ${RunningX64}
    ${Refuse} 4 "$(NOT_64_BIT)"
  ${EndIf}
  SetRegView 64
  Call ChooseUsers
  ReadRegStr $0 SHCTX "${UNKEY}" "DisplayVersion"
  ReadRegStr $1 SHCTX "${UNKEY}" "Order"
  ${If} $0 != ""
    ${VersionCompare} "$1" "${ORDER}" $1
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
  Push "$INSTDIR"
  Call AwaitEnd
  ${If} $Before != ""
    Push "$Before"
    Call AwaitEnd
  ${EndIf}

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
  ${If} ${ShellVarContextAll}
    WriteINIStr "$INSTDIR\${MARKER}" "install" "users" "all"
  ${EndIf}
  FlushINI "$INSTDIR\${MARKER}"

  Call RemoveBefore
  SetOutPath "$PROFILE" ; in which programs begin that are started from the menu
  CreateDirectory "${MENU}"
  CreateShortCut "${MENU}\${NAME}.lnk" "$INSTDIR\${EXE}" "" "$INSTDIR\${EXE}" 0
  CreateShortCut "${MENU}\$(CONSOLE).lnk" "$SYSDIR\cmd.exe" \
    '/k set "PATH=$INSTDIR\bin;%PATH%" && lightpen --help' "$INSTDIR\${EXE}" 0

  WriteRegStr SHCTX "${APPPATH}" "" "$INSTDIR\${EXE}"
  WriteRegStr SHCTX "${UNKEY}" "DisplayName" "${NAME}"
  WriteRegStr SHCTX "${UNKEY}" "DisplayVersion" "${VERSION}"
  WriteRegStr SHCTX "${UNKEY}" "Order" "${ORDER}" ; candidates come before the release
  WriteRegStr SHCTX "${UNKEY}" "Publisher" "${PUBLISHER}"
  WriteRegStr SHCTX "${UNKEY}" "DisplayIcon" "$INSTDIR\${EXE},0"
  WriteRegStr SHCTX "${UNKEY}" "InstallLocation" "$INSTDIR"
  WriteRegStr SHCTX "${UNKEY}" "UninstallString" '"$INSTDIR\uninstall.exe"'
  WriteRegStr SHCTX "${UNKEY}" "QuietUninstallString" '"$INSTDIR\uninstall.exe" /S'
  WriteRegDWORD SHCTX "${UNKEY}" "EstimatedSize" ${SIZE_KB}
  WriteRegDWORD SHCTX "${UNKEY}" "NoModify" 1
  WriteRegDWORD SHCTX "${UNKEY}" "NoRepair" 1

  ; The file in the folder of each swing opens with a double click. Results are JSON,
  ; whose double click belongs to the user's editor: there Lightpen is in "Open with".
  WriteRegStr SHCTX "${CLASSES}\${SWING}" "" "$(SWING_FILE)"
  WriteRegStr SHCTX "${CLASSES}\${SWING}\DefaultIcon" "" "$INSTDIR\${EXE},0"
  WriteRegStr SHCTX "${CLASSES}\${SWING}\shell\open\command" "" '"$INSTDIR\${EXE}" open "%1"'
  WriteRegStr SHCTX "${CLASSES}\.lightpen\OpenWithProgids" "${SWING}" ""
  ReadRegStr $0 SHCTX "${CLASSES}\.lightpen" ""
  ${If} $0 == ""
    WriteRegStr SHCTX "${CLASSES}\.lightpen" "" "${SWING}"
  ${EndIf}
  WriteRegStr SHCTX "${CLASSES}\${RESULT}" "" "$(RESULT_FILE)"
  WriteRegStr SHCTX "${CLASSES}\${RESULT}\DefaultIcon" "" "$INSTDIR\${EXE},0"
  WriteRegStr SHCTX "${CLASSES}\${RESULT}\shell\open\command" "" '"$INSTDIR\${EXE}" open "%1"'
  WriteRegStr SHCTX "${CLASSES}\.json\OpenWithProgids" "${RESULT}" ""
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
  ReadINIStr $0 "$INSTDIR\${MARKER}" "install" "users"
  ${If} $0 == "all"
    UserInfo::GetAccountType
    Pop $1
    ${If} $1 != "Admin"
      ${IfNot} ${Silent} ; "Installed apps" starts it with the rights of the user
        ExecShell "runas" "$INSTDIR\uninstall.exe"
        Quit
      ${EndIf}
      ${Refuse} 11 "$(NO_ADMINISTRATOR)"
    ${EndIf}
    SetShellVarContext all
  ${EndIf}
FunctionEnd

Section "Uninstall"
  Push "$INSTDIR"
  Call un.AwaitEnd
  Call un.RemoveFiles
  Delete "$INSTDIR\${MARKER}"
  Delete "$INSTDIR\uninstall.exe"
  RMDir "$INSTDIR" ; if nothing else is in it

  Delete "${MENU}\*.lnk" ; named in the language of the installation
  RMDir "${MENU}"
  Delete "$DESKTOP\${NAME}.lnk"
  ReadRegStr $0 SHCTX "${CLASSES}\.lightpen" ""
  ${If} $0 == "${SWING}"
    DeleteRegValue SHCTX "${CLASSES}\.lightpen" ""
  ${EndIf}
  DeleteRegValue SHCTX "${CLASSES}\.lightpen\OpenWithProgids" "${SWING}"
  DeleteRegKey /ifempty SHCTX "${CLASSES}\.lightpen\OpenWithProgids"
  ; "If empty" knows of keys only: what another program has set must stay.
  ReadRegStr $0 SHCTX "${CLASSES}\.lightpen" ""
  ${If} $0 == ""
    DeleteRegKey /ifempty SHCTX "${CLASSES}\.lightpen"
  ${EndIf}
  DeleteRegValue SHCTX "${CLASSES}\.json\OpenWithProgids" "${RESULT}"
  EnumRegValue $0 SHCTX "${CLASSES}\.json\OpenWithProgids" 0
  ${If} $0 == ""
    DeleteRegKey /ifempty SHCTX "${CLASSES}\.json\OpenWithProgids"
    ReadRegStr $0 SHCTX "${CLASSES}\.json" ""
    EnumRegValue $1 SHCTX "${CLASSES}\.json" 0
    ${If} $0 == ""
    ${AndIf} $1 == ""
      DeleteRegKey /ifempty SHCTX "${CLASSES}\.json"
    ${EndIf}
  ${EndIf}
  DeleteRegKey SHCTX "${CLASSES}\${SWING}"
  DeleteRegKey SHCTX "${CLASSES}\${RESULT}"
  DeleteRegKey SHCTX "${APPPATH}"
  DeleteRegKey SHCTX "${UNKEY}"
  ${NotifyShell_AssocChanged}

  ${un.GetParameters} $0
  ClearErrors
  ${un.GetOptions} $0 "/PURGE" $1
  ${IfNot} ${Errors}
    SetShellVarContext current
    RMDir /r "${DATA}"
    RMDir /r "${DATA}-keys"
  ${EndIf}
SectionEnd
